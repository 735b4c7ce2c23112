# SPDX-License-Identifier: BSD-3-Clause
"""A recording of a robot from an engine that is independent of the estimator's own model.

The P-controller of the paper, or a servo where joints are rigid, reads the noisy, quantized encoders at every tick and
its command acts, held, from its stamp until the next one. The engine starts at rest with relaxed springs; where effects
load them at rest, it settles before the recording begins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.simulator.loop.controller import PController
from jointscope.tools.simulator.loop.motion import make_motion
from jointscope.tools.simulator.loop.sensing import Sampling
from jointscope.tools.simulator.loop.servo import Servo
from jointscope.tools.simulator.occasion import Conditions, Occasion
from jointscope.tools.simulator.world.disturbance import Disturbance
from jointscope.tools.simulator.world.engine import STEPS_PER_TICK, TICK

Array = NDArray[np.float64]

DEFAULT_SECONDS = {"calibration": 65.0, "moves": 30.0}


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
    target_rate: float = 200.0,
    hardware_seed: int | None = None,
    steps_per_tick: int = STEPS_PER_TICK,
    progress: Callable[[float], None] | None = None,
) -> Simulation:
    """Simulates a robot under the P-controller of the paper, or under a servo where joints are rigid.

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
        target_rate: of cameras and motion capture [Hz].
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
    seconds = DEFAULT_SECONDS.get(motion, 30.0) if seconds is None else float(seconds)
    sampling = Sampling(encoder_rate, gyro_rate, jitter, drop, transport_delay, quantized, target_rate)
    conditions = Conditions(
        parameters or {}, effects, friction, disturbance or Disturbance(), sampling, hardware_seed, steps_per_tick
    )
    return simulate_under(conditions, robot, motion, seconds, seed, progress)


def simulate_under(
    conditions: Conditions,
    robot: Robot,
    motion: str,
    seconds: float,
    seed: int,
    progress: Callable[[float], None] | None = None,
) -> Simulation:
    """As `simulate`, with all that is true of robot and sensors in one argument."""
    robot.need_link_dynamics()
    occasion = Occasion(robot, motion, seconds, seed, conditions)
    schedule = make_motion(motion, robot, occasion.times, occasion.start, occasion.random("targets"))
    truth = occasion.truth
    law = PController if len(truth.layout.motors) == truth.n else Servo
    controller = law(truth, schedule, occasion.encoder())
    trajectory = occasion.run(controller, progress)
    states, extra_states = occasion.states(trajectory)
    recording = occasion.recording(trajectory, controller.commands)
    return Simulation(recording, occasion.told(), states, occasion.times, extra_states)
