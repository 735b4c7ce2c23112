# SPDX-License-Identifier: BSD-3-Clause
"""One robot on one occasion: the engine with its effects, the sensors, the start, and all random numbers.

A controller runs on it; afterwards it tells what was recorded and what was true. The same seed and name give the same
occasion again, so that several controllers can be compared on exactly the same robot, noise and disturbance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.units import si_unit
from jointscope.tools.simulator.effects import make_effects
from jointscope.tools.simulator.loop.motion import MIN_REST, start_position
from jointscope.tools.simulator.loop.online_encoder import OnlineEncoder
from jointscope.tools.simulator.loop.sampled_sensor import (
    SampledAccelerometer,
    SampledCurrent,
    SampledEncoder,
    SampledGyro,
    SampledSensor,
    SampledTarget,
    SampledTorque,
)
from jointscope.tools.simulator.loop.sensing import MountedAccelerometer, MountedGyro, Sampling
from jointscope.tools.simulator.truth import effect_records, true_parameters, true_robot
from jointscope.tools.simulator.world.disturbance import Disturbance
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.engine import STEPS_PER_TICK, TICK, Controller, Engine
from jointscope.tools.simulator.world.random_streams import random_stream
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]

START_NS = 1_767_225_600_000_000_000  # 2026-01-01 00:00 UTC: the same run gives the same bag


@dataclass(frozen=True)
class Conditions:
    """What is true of the robot and its sensors, whatever moves it.

    Attributes:
        parameters: true values by full name where they shall differ.
        effects: texts ID@OWNER[:param=value,...].
        friction: "dry" or "smooth", see `Engine`.
        disturbance: random torques.
        sampling: of the sensors.
        hardware_seed: of the mounting errors; None: the seed of the occasion.
        steps_per_tick: integration steps per millisecond.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    effects: Iterable[str] = ()
    friction: str = "dry"
    disturbance: Disturbance = field(default_factory=Disturbance)
    sampling: Sampling = field(default_factory=Sampling)
    hardware_seed: int | None = None
    steps_per_tick: int = STEPS_PER_TICK


class Occasion:
    """A robot that stands at its start.

    Args:
        robot: the robot; where it has a published value, that is the truth, else the value of its file.
        motion: name of the motion; another one is another occasion.
        seconds: duration [s].
        seed: of everything random.
        conditions: what is true.

    Attributes:
        truth: the robot with its true parameters.
        times: of the ticks, shape (n,) [s].
        start: joint angles, shape (n_joints,) [rad].
        engine: compiled, not yet moved.
        gyros, accelerometers: as they are mounted.

    Raises:
        SimulationError: MuJoCo is missing, or an option is impossible.
        EffectError: an effect is unknown or impossible.
        RobotError: an unknown parameter.
    """

    def __init__(self, robot: Robot, motion: str, seconds: float, seed: int, conditions: Conditions):
        hardware_seed = seed if conditions.hardware_seed is None else conditions.hardware_seed
        _check_seeds(seed, hardware_seed)
        self.times = _ticks(seconds)
        self.truth = true_robot(robot, conditions.parameters)
        effects = make_effects(conditions.effects, self.truth)
        self.engine = self._engine(effects, conditions)
        self._seed = int(random_stream(seed, motion).integers(2**31))
        # Biases belong to the occasion, mounting errors to the robot.
        self.gyros = [
            MountedGyro.draw(g, self.random("bias", g.name), random_stream(hardware_seed, "mounting", g.name))
            for g in robot.gyros
        ]
        mounted = {gyro.sensor.name: gyro.R_imu_body for gyro in self.gyros}
        self.accelerometers = [
            MountedAccelerometer.draw(s, self.random("bias", s.name), mounted[s.gyro], robot.gravity_at(s))
            for s in robot.accelerometers
        ]
        self.start = start_position(robot, self.random("start"))
        self._robot, self._conditions = robot, conditions
        self._encoder_noise = self.random("noise", "encoder").standard_normal((len(self.times), robot.n))
        names = {"robot": robot.name, "motion": motion, "seconds": seconds}
        self._told: dict[str, Any] = {**names, "seed": seed, "hardware_seed": hardware_seed}

    def _engine(self, effects: Sequence[SimulatedEffect], conditions: Conditions) -> Engine:
        return Engine(self.truth, effects, conditions.friction, conditions.steps_per_tick)

    def random(self, *purpose: str) -> np.random.Generator:
        """The occasion's own random numbers for a purpose."""
        return random_stream(self._seed, *purpose)

    def encoder(self) -> OnlineEncoder:
        """The motor encoders as a controller reads them at its ticks."""
        sampling = self._conditions.sampling
        return OnlineEncoder(self._robot.motor_encoder, self.engine, self._encoder_noise, sampling.quantized)

    def sensors(self) -> list[SampledSensor]:
        """All sensors in the order of the robot file."""
        sampling, seed = self._conditions.sampling, self._seed
        encoder, seconds = self._robot.motor_encoder, len(self.times) * TICK

        def stamps(name: str, rate: float) -> Array:
            return sampling.stamps(rate, seconds, self.random("jitter", name))

        times = stamps(encoder.name, sampling.encoder_rate)
        noise = self._encoder_noise  # at the rate of the controller, the recording holds what the controller saw
        if len(times) != len(noise):
            noise = self.random("noise", encoder.name).standard_normal((len(times), self._robot.n))
        found: dict[str, SampledSensor] = {
            encoder.name: SampledEncoder(encoder, self.engine, sampling, times, seed, noise)
        }
        links = self._robot.link_encoder
        if links is not None:
            times = stamps(links.name, sampling.encoder_rate)
            noise = self.random("noise", links.name).standard_normal((len(times), self._robot.n))
            found[links.name] = SampledEncoder(links, self.engine, sampling, times, seed, noise)
        torque = self._robot.torque_sensor
        if torque is not None:
            times = stamps(torque.name, sampling.encoder_rate)
            found[torque.name] = SampledTorque(torque, self.engine, sampling, times, seed, self.truth)
        current = self._robot.motor_current
        if current is not None:
            times = stamps(current.name, sampling.encoder_rate)
            found[current.name] = SampledCurrent(current, self.engine, sampling, times, seed, self.truth)
        for target in self._robot.targets:
            times = stamps(target.name, sampling.target_rate)
            found[target.name] = SampledTarget(target, self.engine, sampling, times, seed, self.truth)
        for gyro in self.gyros:
            times = stamps(gyro.sensor.name, sampling.gyro_rate)
            found[gyro.sensor.name] = SampledGyro(gyro, self.engine, sampling, times, seed)
        for accelerometer in self.accelerometers:
            sensor = accelerometer.sensor
            # one message of an IMU holds both of its sensors
            times = found[sensor.gyro].stamps
            found[sensor.name] = SampledAccelerometer(accelerometer, self.engine, sampling, times, seed)
        return [found[name] for name in self._robot.sensors]

    def run(self, controller: Controller, progress: Callable[[float], None] | None = None) -> Trajectory:
        """Lets a controller move the robot from its start.

        Args:
            controller: see `Engine.run`.
            progress: called with the share done, 0 to 1.

        Raises:
            SimulationError: the integration diverged.
        """
        ticks, torques = len(self.times), self.disturbances()
        self.engine.place(self.start)
        if any(effect.loads_at_rest for effect in self.engine.effects):
            self.engine.settle()
        return self.engine.run(controller, *torques, lambda done: progress(done / ticks) if progress else None)

    def disturbances(self) -> tuple[Array, Array]:
        """Random torques on links and rotors at the ticks, shape (n, n_joints) each [N m]."""
        rng, shape = self.random("disturbance"), (len(self.times), self._robot.n)
        return self._conditions.disturbance.torques(rng, *shape, TICK)

    def ended(self, ticks: int) -> None:
        """Forgets what would have been after so many ticks: whoever moved the robot has finished."""
        self.times, self._encoder_noise = self.times[:ticks], self._encoder_noise[:ticks]
        self._told["seconds"] = ticks * TICK

    def recording(self, trajectory: Trajectory, commands: Array, every: int = 1) -> Recording:
        """What a bag holds of a run.

        Args:
            trajectory: of the engine.
            commands: shape (n, n_joints), in the unit of the robot's command.
            every: ticks from one command to the next.
        """
        sampling, robot, times = self._conditions.sampling, self._robot, self.times[::every]
        received = sampling.received(times, self.random("transport", "command"))
        channels = tuple(f"{joint}.command" for joint in robot.joints)
        command = Stream("command", times, commands, channels, si_unit(robot.command.unit), received)
        streams = {sensor.sensor.name: sensor.stream(trajectory) for sensor in self.sensors()}
        return Recording("simulation", "", START_NS, {"command": command, **streams})

    def told(self) -> dict[str, Any]:
        """What is true, fit for JSON."""
        effects, conditions = self.engine.effects, self._conditions
        return {
            "parameters": true_parameters(self.truth, self.gyros, self.accelerometers, effects),
            "effects": effect_records(effects),
            **self._told,
            "friction": conditions.friction,
            "disturbance": asdict(conditions.disturbance),
            "sampling": asdict(conditions.sampling),
        }

    def at_ticks(self, fine: Array) -> Array:
        """Rows of a trajectory's array at the ticks, shape (n, nq)."""
        steps = self._conditions.steps_per_tick
        return fine[: len(self.times) * steps : steps]

    def states(self, trajectory: Trajectory) -> tuple[Array, dict[str, Array]]:
        """(q_link, v_link, q_motor, v_motor) at the ticks, shape (n, 4 n_joints), and the further coordinates.

        The latter are position and velocity, shape (n, 2), by the name that an effect gave them.
        """
        engine, q, v = self.engine, self.at_ticks(trajectory.q), self.at_ticks(trajectory.v)
        states = np.hstack([q[:, engine.link], v[:, engine.link], q[:, engine.motor], v[:, engine.motor]])
        own = {*engine.link, *engine.motor}
        extra = {name: np.column_stack([q[:, i], v[:, i]]) for i, name in enumerate(engine.coordinates) if i not in own}
        return states, extra


def _check_seeds(*seeds: int) -> None:
    for seed in seeds:
        if seed < 0:
            raise SimulationError(f"seed: expected a number of 0 or more, got {seed}")


def _ticks(seconds: float) -> Array:
    if not 2.0 * MIN_REST <= seconds <= 24 * 3600.0:
        raise SimulationError(
            f"seconds: expected {2 * MIN_REST:g} s to one day, got {seconds:g}; it begins and ends at rest. "
            "For less, simulate longer and cut the recording with `recording.between(t0, t1)`"
        )
    return np.arange(round(seconds / TICK), dtype=np.float64) * TICK
