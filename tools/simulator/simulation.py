# SPDX-License-Identifier: BSD-3-Clause
"""A recording of a robot from an engine that is independent of the estimator's own model.

The P-controller of the paper reads the noisy, quantized encoders at every tick and its command acts, held, from its
stamp until the next one. The engine starts at rest with relaxed springs; where effects load them at rest, it settles
before the recording begins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.recording import Recording, Stream
from jointscope.robots.robot import Robot
from jointscope.robots.units import si_unit
from jointscope.tools.simulator.controller import PController
from jointscope.tools.simulator.disturbance import Disturbance
from jointscope.tools.simulator.effects import make_effects
from jointscope.tools.simulator.engine import STEPS_PER_TICK, TICK, Engine
from jointscope.tools.simulator.motion import MIN_REST, make_motion, start_position
from jointscope.tools.simulator.random_streams import random_stream
from jointscope.tools.simulator.sensing import MountedGyro, Sampling, encoder_stream, gyro_stream
from jointscope.tools.simulator.trajectory import Trajectory
from jointscope.tools.simulator.truth import effect_records, true_parameters, true_robot

Array = NDArray[np.float64]

DEFAULT_SECONDS = {"calibration": 65.0, "moves": 30.0}
START_NS = 1_767_225_600_000_000_000  # 2026-01-01 00:00 UTC: the same run gives the same bag


@dataclass(frozen=True)
class Simulation:
    """A simulated recording and what was really going on.

    Attributes:
        recording: what the bag will hold.
        truth: parameters by full name, effects and settings; fit for JSON.
        states: at the ticks of the command, (q_link, v_link, q_motor, v_motor), shape (n, 4 n_joints) [rad], [rad/s].
        state_times: shape (n,) [s].
        extra_states: position and velocity of every further coordinate that an effect brought in, by its name in the
            engine ("joint1.bearing_x"), each of shape (n, 2).
    """

    recording: Recording
    truth: dict[str, Any]
    states: Array
    state_times: Array
    extra_states: dict[str, Array]


def simulate(
    robot: Robot,
    motion: str = "calibration",
    seconds: float | None = None,
    seed: int = 0,
    *,
    parameters: Mapping[str, float] | None = None,
    effects: Iterable[str] = (),
    friction: str = "dry",
    disturbance: Disturbance | None = None,
    jitter: float = 0.0,
    drop: float = 0.0,
    encoder_rate: float = 1.0 / TICK,
    gyro_rate: float = 1.0 / TICK,
    transport_delay: float = 5e-4,
    quantized: bool = True,
    hardware_seed: int | None = None,
    steps_per_tick: int = STEPS_PER_TICK,
    progress: Callable[[float], None] | None = None,
) -> Simulation:
    """Simulates a robot under the P-controller of the paper.

    Args:
        robot: the robot; where it has a published value, that is the truth, else the value of its file.
        motion: "calibration" (Fig. 3) or "moves" (other positions, no chirp).
        seconds: duration; 65 for "calibration", 30 for "moves" if not given [s].
        seed: of everything random. The same seed with another motion is the same robot, mounting included, on another
            occasion: start, targets, bias and noise differ.
        parameters: true values by full name where they shall differ.
        effects: texts ID@OWNER[:param=value,...].
        friction: "dry" (the engine's friction loss) or "smooth" (mu tanh(sharpness v)), always on the motor velocity.
        disturbance: random torques.
        jitter: standard deviation of the times of sensor samples [s].
        drop: probability that a sensor sample is lost.
        encoder_rate: [Hz].
        gyro_rate: [Hz].
        transport_delay: mean time from stamp to arrival [s].
        quantized: False gives white encoder noise instead of steps.
        hardware_seed: of the mounting errors, if it shall differ from `seed`.
        steps_per_tick: integration steps per millisecond.
        progress: called with the share done, 0 to 1.

    Returns:
        Recording, truth and states.

    Raises:
        SimulationError: MuJoCo is missing, an option is impossible, or the integration diverged.
        EffectError: an effect is unknown or impossible.
        RobotError: an unknown parameter.
    """
    sampling = Sampling(encoder_rate, gyro_rate, jitter, drop, transport_delay, quantized)
    disturbance = disturbance or Disturbance()
    hardware_seed = seed if hardware_seed is None else hardware_seed
    _check_seeds(seed, hardware_seed)
    seconds = DEFAULT_SECONDS.get(motion, 30.0) if seconds is None else float(seconds)
    times = _ticks(seconds)
    truth = true_robot(robot, parameters or {})
    built = make_effects(effects, truth)
    engine = Engine(truth, built, friction, steps_per_tick)
    occasion = int(random_stream(seed, motion).integers(2**31))
    gyros = _mounted_gyros(robot, occasion, hardware_seed)
    noise = random_stream(occasion, "noise", "encoder").standard_normal((len(times), robot.n))
    start = start_position(robot, random_stream(occasion, "start"))
    schedule = make_motion(motion, robot, times, start, random_stream(occasion, "targets"))
    controller = PController(truth, schedule, noise, quantized, built)
    torques = disturbance.torques(random_stream(occasion, "disturbance"), len(times), robot.n, TICK)
    engine.place(start)
    if any(effect.loads_at_rest for effect in built):
        engine.settle()
    trajectory = engine.run(controller, *torques, _share(progress, len(times)))
    command = _command_stream(robot, times, controller.commands, sampling, occasion)
    streams = {"command": command, **_sensor_streams(engine, trajectory, gyros, noise, robot, sampling, occasion)}
    told = {
        "parameters": true_parameters(truth, gyros, built),
        "effects": effect_records(built),
        **{"robot": robot.name, "motion": motion, "seconds": seconds, "seed": seed, "hardware_seed": hardware_seed},
        **{"friction": friction, "disturbance": asdict(disturbance), "sampling": asdict(sampling)},
    }
    recording = Recording("simulation", "", START_NS, streams)
    return Simulation(recording, told, *_states(engine, trajectory, times, steps_per_tick))


def _check_seeds(*seeds: int) -> None:
    for seed in seeds:
        if seed < 0:
            raise SimulationError(f"seed: expected a number of 0 or more, got {seed}")


def _mounted_gyros(robot: Robot, occasion: int, hardware_seed: int) -> list[MountedGyro]:
    """Biases belong to the occasion, mounting errors to the robot."""
    return [
        MountedGyro.draw(g, random_stream(occasion, "bias", g.name), random_stream(hardware_seed, "mounting", g.name))
        for g in robot.gyros
    ]


def _ticks(seconds: float) -> Array:
    if not 2.0 * MIN_REST <= seconds <= 24 * 3600.0:
        raise SimulationError(f"seconds: expected {2 * MIN_REST:g} s to one day, got {seconds:g}")
    return np.arange(round(seconds / TICK), dtype=np.float64) * TICK


def _share(progress: Callable[[float], None] | None, ticks: int) -> Callable[[int], None]:
    def report(done: int) -> None:
        if progress is not None:
            progress(done / ticks)

    return report


def _command_stream(robot: Robot, times: Array, commands: Array, sampling: Sampling, occasion: int) -> Stream:
    received = sampling.received(times, random_stream(occasion, "transport", "command"))
    channels = tuple(f"{joint}.command" for joint in robot.joints)
    return Stream("command", times, commands, channels, si_unit(robot.command.unit), received)


def _sensor_streams(
    engine: Engine,
    trajectory: Trajectory,
    gyros: list[MountedGyro],
    tick_noise: Array,
    robot: Robot,
    sampling: Sampling,
    occasion: int,
) -> dict[str, Stream]:
    seconds, encoder = len(tick_noise) * TICK, robot.motor_encoder

    def stamps(name: str, rate: float) -> Array:
        return sampling.stamps(rate, seconds, random_stream(occasion, "jitter", name))

    times = stamps(encoder.name, sampling.encoder_rate)
    noise = tick_noise  # at the rate of the controller, the recording holds what the controller saw
    if len(times) != len(tick_noise):
        noise = random_stream(occasion, "noise", encoder.name).standard_normal((len(times), robot.n))
    streams = {encoder.name: encoder_stream(encoder, engine, trajectory, times, noise, sampling, occasion)}
    for gyro in gyros:
        name = gyro.sensor.name
        times = stamps(name, sampling.gyro_rate)
        streams[name] = gyro_stream(gyro, engine, trajectory, times, sampling, occasion)
    return {name: streams[name] for name in robot.sensors}


def _states(
    engine: Engine, trajectory: Trajectory, times: Array, steps_per_tick: int
) -> tuple[Array, Array, dict[str, Array]]:
    """States at the ticks, their times, and the further coordinates."""
    at_ticks = slice(0, len(times) * steps_per_tick, steps_per_tick)
    q, v = trajectory.q[at_ticks], trajectory.v[at_ticks]
    states = np.hstack([q[:, engine.link], v[:, engine.link], q[:, engine.motor], v[:, engine.motor]])
    own = {*engine.link, *engine.motor}
    extra = {name: np.column_stack([q[:, i], v[:, i]]) for i, name in enumerate(engine.coordinates) if i not in own}
    return states, times, extra
