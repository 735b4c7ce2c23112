# SPDX-License-Identifier: BSD-3-Clause
"""Counts, alarms and events of an estimator, and the glitches that may have been none."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointscope.graphs.fixed_lag.clock_watch import ClockWatch
from jointscope.graphs.fixed_lag.consistency import Consistency
from jointscope.graphs.fixed_lag.innovation import Innovation
from jointscope.graphs.fixed_lag.observation import Observation
from jointscope.graphs.fixed_lag.sample_intake import SampleIntake
from jointscope.graphs.fixed_lag.status import EstimatorStatus, EventLog
from jointscope.graphs.fixed_lag.stream_watch import StreamWatch
from jointscope.robots.robot import Robot

NIS_EVERY = 10  # updates between two looks at the channels
MOST_REFUSED = 50  # samples taken for glitches that may come back when a late command explains them


class Bookkeeping:
    """What an estimator knows about its data.

    Args:
        robot: sensors.
        lag: length of the estimator's window [s].

    Attributes:
        status: counters and alarms.
        log: events.
        intake: checks and counts messages.
        watch: silence of streams.
        clock: stamps that cannot be.
    """

    def __init__(self, robot: Robot, lag: float):
        self._robot = robot
        self.status, self.log = EstimatorStatus(), EventLog()
        self.clock = ClockWatch(robot.motor_encoder.name, lag)
        self.intake = SampleIntake(robot, self.status, self.log, self.clock)
        self.watch, self._consistency = StreamWatch(robot, self.log), Consistency()
        self._refused: deque[Observation] = deque(maxlen=MOST_REFUSED)

    def updated(self, time: float, innovations: Sequence[Innovation]) -> bool:
        """After an update at a time: alarms; returns whether the encoders fit."""
        status = self.status
        status.updates += 1
        for channel, mean_square, begins in self._consistency.add(innovations):
            self._tell_alarm(time, channel, mean_square, begins)
        status.nis_mean = self._consistency.nis_mean
        if status.updates % NIS_EVERY == 0:
            status.nis = self._consistency.mean_square
        status.lost = self.watch.check(time)
        return self.watch.fits(time, innovations)

    def count(self, looked_at: Sequence[Observation], innovations: Sequence[Innovation]) -> None:
        """Counts samples that were used, and those that were taken for glitches."""
        for innovation in innovations:
            if innovation.used:
                self.status.used[innovation.sensor] += 1
            else:
                self.intake.outlier(innovation)
                self._refuse(innovation, looked_at)

    def readmitted(self, since: float) -> list[Observation]:
        """Samples taken for glitches where commands were not what they seemed; they get another chance."""
        again = [o for o in self._refused if o.taken >= since]
        for o in again:
            self.status.dropped[o.sensor]["outlier"] -= 1
        self._refused.clear()
        return again

    def begins_anew(self) -> None:
        """Nothing comes back any more, and innovations are those of another estimate."""
        self._refused.clear()
        self._consistency, self.status.alarms = Consistency(), ()

    def clock_was_set(self) -> None:
        """Stamps have nothing to do with those before."""
        self.clock.follow()
        self.intake.forget_stamps()
        self.watch = StreamWatch(self._robot, self.log)

    def _refuse(self, innovation: Innovation, used: Sequence[Observation]) -> None:
        names = self._robot.sensors[innovation.sensor].channels
        for o in used:
            if (o.sensor, o.stamp) == (innovation.sensor, innovation.time):
                mask = np.array([names[c] in innovation.channels for c in o.channels.tolist()])
                if mask.any():
                    part = replace(o, channels=o.channels[mask], values=o.values[mask], sigma=o.sigma[mask])
                    self._refused.append(part)

    def _tell_alarm(self, time: float, channel: str, mean_square: float, begins: bool) -> None:
        self.status.alarms = tuple(self._consistency.alarms)
        if begins:
            times = f"{math.sqrt(mean_square):.1f} times as large as expected"
            self.log.tell(time, "alarm", channel, f"innovations of {channel} are {times}; diagnose says why")
        else:
            self.log.tell(time, "alarm_over", channel, f"innovations of {channel} are as large as expected again")
