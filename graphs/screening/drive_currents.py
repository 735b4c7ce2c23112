# SPDX-License-Identifier: BSD-3-Clause
"""Measured currents as combinations of what drives their motors.

Whatever the robot, the current of a motor is

    i(t) = a u(t - delay) + b v_motor(t - delay) + c

with b only where the command is a voltage. A command jumps at its stamps: a delay cannot be followed downhill, but the
share of a current that its drive leaves can be worked out for each of many delays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.problem.timeline import SAME, Timeline
from jointscope.graphs.screening.windowed_motion import windowed_motion
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

WINDOW = 0.01  # [s] of a mean speed
PERIODS = 3.0  # of the encoders, which a window is long at least
SAMPLES, FEWEST = 4000, 200
EARLIEST, LATEST = -0.004, 0.03  # [s] delays that are looked at


@dataclass(frozen=True)
class CurrentFit:
    """A channel as a combination of a drive's signals.

    Attributes:
        left: sum of squares that is left [A^2].
        share: root of the mean of these as a share of the channel's standard deviation.
        by_command: a [A per unit of the command].
        by_speed: b [A s/rad]; 0 where the command is no voltage.
        at_rest: c [A].
    """

    left: float
    share: float
    by_command: float
    by_speed: float
    at_rest: float


@dataclass(frozen=True)
class DriveCurrents:
    """Some samples of the currents of a recording, and signals of all drives at any time.

    Attributes:
        times: of the samples, shape (m,) [s].
        currents: there, shape (m, n) [A].
        timeline: ticks, and the commands that act between them.
        v: speeds of the motors at the ticks, shape (k + 1, n) [rad/s].
        by_volts: whether speeds take current away.
    """

    times: Array
    currents: Array
    timeline: Timeline
    v: Array
    by_volts: bool

    @staticmethod
    def of(recording: Recording, robot: Robot) -> DriveCurrents | None:
        """None where the recording is too short."""
        sensor = robot.motor_current
        assert sensor is not None
        stream, timeline = recording.streams[sensor.name], Timeline.of(recording, robot.command_held)
        usable = recording.are_judged(stream.times)
        if stream.filled is not None:
            usable &= ~stream.filled.any(axis=1)
        path = CommandPath(timeline.ticks, timeline.u, robot.effects, robot.joints, not robot.command_held)
        acting = replace(timeline, u=path.acting(robot.values)[0])
        encoder = recording.streams[robot.motor_encoder.name]
        return DriveCurrents.beside(stream, encoder, acting, "k_mi" in robot.drive_laws, usable)

    @staticmethod
    def beside(
        currents: Stream, encoder: Stream, timeline: Timeline, by_volts: bool, usable: NDArray[np.bool_] | None = None
    ) -> DriveCurrents | None:
        """The same of some streams.

        Args:
            currents: one channel per joint.
            encoder: positions of the motors.
            timeline: with the commands that act.
            by_volts: whether speeds take current away.
            usable: which samples of the currents are, shape (m,); None for all.
        """
        window = max(WINDOW, PERIODS * float(np.max(encoder.periods)))
        begin = max(timeline.ticks[0], encoder.times[0] + 2.0 * window)
        end = min(timeline.ticks[-1], encoder.times[-1] - 2.0 * window)
        inside = (currents.times > begin + LATEST) & (currents.times < end + EARLIEST)
        found = np.flatnonzero(inside if usable is None else inside & usable)
        if len(found) < FEWEST:
            return None
        chosen = found[:: max(len(found) // SAMPLES, 1)]
        v = windowed_motion(encoder, np.clip(timeline.ticks, begin, end), window).v
        return DriveCurrents(currents.times[chosen], currents.values[chosen], timeline, v, by_volts)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.currents.shape[1]

    @property
    def h(self) -> float:
        """Usual length of a step [s]."""
        return float(np.median(self.timeline.h))

    def steps(self, late: float) -> NDArray[np.intp]:
        """Steps whose commands act so long before the samples; at a tick it is the one that has acted until then."""
        return self.timeline.locate_ending(self.times - late - SAME)[0]

    def fit(self, joint: int, channel: int, by_u: float, by_v: float) -> CurrentFit:
        """A channel by the command of a joint that is so much older, and by its speed [s]."""
        columns = [self.timeline.u[self.steps(by_u), joint], np.ones(len(self.times))]
        if self.by_volts:
            columns.append(np.interp(self.times - by_v, self.timeline.ticks, self.v[:, joint]))
        A, y = np.column_stack(columns), self.currents[:, channel]
        found, size = np.linalg.lstsq(A, y, rcond=None)[0], float(np.std(y))
        left = float(np.sum((y - A @ found) ** 2))
        share = float(np.sqrt(left / len(y))) / size if size > 0.0 else np.inf
        return CurrentFit(left, share, float(found[0]), float(found[2]) if self.by_volts else 0.0, float(found[1]))
