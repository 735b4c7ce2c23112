# SPDX-License-Identifier: BSD-3-Clause
"""Counts, alarms and events of an estimator."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from jointscope.graphs.fixed_lag.messages.clock_watch import ClockWatch
from jointscope.graphs.fixed_lag.messages.consistency import Consistency
from jointscope.graphs.fixed_lag.messages.sample_intake import SampleIntake
from jointscope.graphs.fixed_lag.messages.status import EstimatorStatus, EventLog
from jointscope.graphs.fixed_lag.messages.stream_watch import StreamWatch
from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.robots.model.robot import Robot

NIS_EVERY = 10  # updates between two looks at the channels


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

    def count(self, innovations: Sequence[Innovation]) -> None:
        """Counts samples that were used, and those that were taken for glitches."""
        for innovation in innovations:
            if innovation.used:
                self.status.used[innovation.sensor] += 1
            else:
                self.intake.outlier(innovation)

    def reconsidered(self, more: Mapping[str, int]) -> None:
        """Late commands have shown other samples to be glitches: by sensor, how many more than before."""
        for name, change in more.items():
            if change:
                self.status.drop(name, "outlier", change)
                self.status.used[name] -= change

    def begins_anew(self) -> None:
        """Innovations are those of another estimate from here on."""
        self._consistency, self.status.alarms = Consistency(), ()

    def clock_was_set(self) -> None:
        """Stamps have nothing to do with those before."""
        self.clock.follow()
        self.intake.forget_stamps()
        self.watch = StreamWatch(self._robot, self.log)

    def _tell_alarm(self, time: float, channel: str, mean_square: float, begins: bool) -> None:
        self.status.alarms = tuple(self._consistency.alarms)
        if begins:
            times = f"{math.sqrt(mean_square):.1f} times as large as expected"
            self.log.tell(time, "alarm", channel, f"innovations of {channel} are {times}; diagnose says why")
        else:
            self.log.tell(time, "alarm_over", channel, f"innovations of {channel} are as large as expected again")
