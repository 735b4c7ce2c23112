# SPDX-License-Identifier: BSD-3-Clause
"""A position-controlled robot simulated with its controller: goals in, positions out, no measurement on the way.

The model alone answers to the goals, from the first measured position at rest to the end of the recording; its errors
add up, but the controller holds them down as it does in the robot. Runge-Kutta of order 4; the controller acts at every
step, and reads the encoders with their errors. A drive that is switched off (goal NaN) is an open bridge: no torque,
and no back-EMF either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.comparison.runge_kutta import StepCuts, runge_kutta
from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.model.readings_at_one_state import ReadingsAtOneState
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.controller_gain import controller_of
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

STEP = 1e-3  # [s]
SEEN = 0.05  # [s] of samples that tell position and speed where a simulation begins anew
FEWEST = 5  # samples for that
BACK_EMF = ".k_mi"


@dataclass(frozen=True)
class FreeRun:
    """A simulated recording.

    Attributes:
        channels: names of the motor encoder's channels.
        times: stamps of the motor encoder without those that are left out, shape (m,) [s].
        simulated, measured: shape (m, n) [rad]; NaN where a channel was not measured.
    """

    channels: tuple[str, ...]
    times: Array
    simulated: Array
    measured: Array

    @property
    def mean_abs(self) -> dict[str, float]:
        """Mean absolute error of every channel [rad]."""
        return self._by_channel(np.nanmean(np.abs(self.simulated - self.measured), axis=0))

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square error of every channel [rad]."""
        return self._by_channel(np.sqrt(np.nanmean((self.simulated - self.measured) ** 2, axis=0)))

    def _by_channel(self, values: Array) -> dict[str, float]:
        return dict(zip(self.channels, values.tolist(), strict=True))


def free_run(robot: Robot, recording: Recording) -> FreeRun:
    """Simulates a recording.

    Raises:
        RobotError: no controller, or effects on the command, which act before the controller's output is known.
        RecordingError: the recording holds no goals.
    """
    robot = robot.in_posture(recording.posture)
    controller, goal = controller_of(robot, recording), recording.goal
    if controller is None:
        raise RobotError(f"{robot.name} has no section `controller`; without it the loop cannot be simulated")
    if goal is None:
        raise RecordingError(
            f"{recording.path} holds no goal positions on {controller.source.topic}; check topic and field of "
            "`controller` in the robot file, or take that section out"
        )
    late = [here.label for here in robot.effects if isinstance(here.effect, CommandEffect)]
    if late:
        raise RobotError(
            f"the loop cannot be simulated with effects on the command yet: {', '.join(late)}; remove them, or "
            "the section `controller`"
        )
    encoder, zero = recording.streams[robot.motor_encoder.name], robot.motor_encoder.zero
    on, off = _Stepper(robot), _Stepper(_without_back_emf(robot))
    layout, sensors = robot.layout, ReadingsAtOneState(robot)
    at_rest = np.zeros((1, len(robot.joints)))
    first = encoder.values[:1] - zero
    joints = np.hstack([joint_angles(robot, first), at_rest, first, at_rest])
    x = layout.from_joints(joints)[0]
    times = np.arange(encoder.times[0], encoder.times[-1] + STEP, STEP)
    wanted = _held(goal, times)
    positions = np.empty((len(times), len(robot.joints)))
    known = [t1 for _, t1 in recording.left_out if np.sum(encoder.times > t1) > FEWEST]
    restarts = {int(np.searchsorted(times, t1, side="right")) for t1 in known}
    for k in range(len(times)):
        if k in restarts:  # what happened in a stretch that is left out is not the model's
            x = layout.from_joints(_measured(robot, encoder, float(times[k])))[0]
        positions[k] = sensors.read(robot.motor_encoder.name, x, float(times[k]))[0]
        command = controller.command(wanted[k], positions[k])
        # one bridge for all joints that are off: their back-EMF goes together
        x = (on if np.isfinite(wanted[k]).all() else off).step(x, command)
    judged = recording.are_judged(encoder.times)
    stamps, measured = encoder.times[judged], encoder.measured[judged]
    positions = np.where(np.isnan(positions), np.inf, positions)  # a model that ran away is no sample that is missing
    simulated = np.column_stack([np.interp(stamps, times, column) for column in positions.T])
    return FreeRun(encoder.channels, stamps, simulated, measured)


def _measured(robot: Robot, encoder: Stream, time: float) -> Array:
    """(q_link, v_link, q_motor, v_motor) as the samples after a moment tell them, springs relaxed, shape (1, 4n)."""
    first = int(np.searchsorted(encoder.times, time))
    last = max(int(np.searchsorted(encoder.times, time + SEEN)), first + FEWEST)
    _, v, q = np.polyfit(encoder.times[first:last] - time, encoder.values[first:last] - robot.motor_encoder.zero, 2)
    return np.hstack([joint_angles(robot, q), joint_angles(robot, v), q, v])[None]


def loop_error(run: FreeRun, robot: Robot) -> float:
    """Root mean square over all channels and the whole recording, in sensor sigmas."""
    rms = np.array([run.rms[channel] for channel in robot.motor_encoder.channels])
    return float(np.sqrt(np.mean((rms / robot.motor_encoder.sigmas) ** 2)))


class _Stepper:
    """Steps of one model."""

    def __init__(self, robot: Robot):
        self._rates = StateRates(robot)
        self._cuts = StepCuts(robot, STEP, self._rates)

    def step(self, x: Array, u: Array) -> Array:
        """The state one step later, shape (d,)."""
        h, torque, before, plays = STEP / self._cuts.fine, self._rates.command_torque(u), x, self._rates.plays
        for _ in range(self._cuts.fine):
            x = runge_kutta(lambda at: self._rates.rates(at, torque), x, h)
        if plays is not None:
            x[plays.lags] = plays.after(before, x, self._rates.play_sizes)
        return x


def _without_back_emf(robot: Robot) -> Robot:
    return robot.with_values({name: 0.0 for name in robot.parameters if name.endswith(BACK_EMF)})


def _held(goal: Stream, times: Array) -> Array:
    """The last goal at every time, shape (k, n); the first one before it came."""
    index = np.clip(np.searchsorted(goal.times, times, side="right") - 1, 0, len(goal.times) - 1)
    return goal.values[index]
