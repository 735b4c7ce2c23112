# SPDX-License-Identifier: BSD-3-Clause
"""Counts, alarms and events of an estimator; which streams have fallen silent, whether the encoders still fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.messages.clock_watch import ClockWatch
from jointscope.graphs.fixed_lag.messages.consistency import Consistency
from jointscope.graphs.fixed_lag.messages.sample_intake import SampleIntake
from jointscope.graphs.fixed_lag.messages.status import EstimatorStatus, EventLog
from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.robots.model.robot import Robot

NIS_EVERY = 10  # updates between two looks at the channels
SILENT = 0.1  # [s] or
PERIODS = 20.0  # usual distances of a stream's samples, whichever is longer
SHARE = 0.05  # weight of a new distance in the running estimate of the usual one
EVERY = 10  # ticks between two looks
CONTRADICTION = 30.0**2  # normalised innovation squared of the encoders per degree of freedom
LONGEST_CONTRADICTION = 0.1  # [s]
COMMAND = "command"


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


class StreamWatch:
    """Remembers when each stream was last heard of.

    Args:
        robot: its encoders.
        log: receives events.
    """

    def __init__(self, robot: Robot, log: EventLog):
        self._log, self._encoder, self._joints = log, robot.motor_encoder.name, robot.joints
        self._last: dict[str, float] = {}
        self._usual: dict[str, float] = {}
        self._lost: dict[str, float] = {}
        self._ticks, self._bad_since = 0, float("inf")

    def seen(self, name: str, t: float) -> None:
        """A message of a stream has come."""
        last = self._last.get(name)
        if last is None or t > last:
            if last is not None:
                usual = self._usual.get(name, t - last)
                self._usual[name] = usual + SHARE * (min(t - last, 10.0 * usual) - usual)
            self._last[name] = t
            if name in self._lost:
                silence = t - self._lost.pop(name)
                kind = "command_back" if _commands(name) else "sensor_back"
                self._log.tell(t, kind, name, f"{name} is back after {silence:.2f} s")

    def commanded(self, t: float, about: NDArray[np.bool_] | None) -> None:
        """A command has come: of all joints, or of those that it is about, shape (n,)."""
        if about is None:
            self.seen(COMMAND, t)
            return
        for joint, own in zip(self._joints, about, strict=True):
            if own:
                self.seen(f"{joint}.{COMMAND}", t)

    def check(self, now: float) -> tuple[str, ...]:
        """Streams that are silent; looks at them every few ticks."""
        self._ticks += 1
        if self._ticks % EVERY == 0:
            for name, last in self._last.items():
                if name not in self._lost and now - last > self._patience(name):
                    self._lost[name] = last
                    kind = "command_lost" if _commands(name) else "sensor_lost"
                    self._log.tell(now, kind, name, f"nothing of {name} since {last:.3f} s")
        return tuple(self._lost)

    def lost_commands(self, now: float) -> NDArray[np.bool_] | None:
        """Joints whose commands have stopped, shape (n,), None without any: their drives may then do what they like."""
        if self._is_lost(COMMAND, now):
            return np.ones(len(self._joints), bool)
        lost = [self._is_lost(f"{joint}.{COMMAND}", now) for joint in self._joints]
        return np.array(lost) if any(lost) else None

    def _is_lost(self, name: str, now: float) -> bool:
        last = self._last.get(name)
        return last is not None and now - last > self._patience(name)

    def fits(self, now: float, innovations: Sequence[Innovation]) -> bool:
        """Whether the encoders have not contradicted the estimate for long."""
        for innovation in innovations:
            if innovation.sensor == self._encoder:
                if innovation.nis < CONTRADICTION * innovation.dof:
                    self._bad_since = float("inf")
                else:
                    self._bad_since = min(self._bad_since, innovation.time)
        if now - self._bad_since > LONGEST_CONTRADICTION:
            self._bad_since = float("inf")
            return False
        return True

    def _patience(self, name: str) -> float:
        return max(SILENT, PERIODS * self._usual.get(name, SILENT))


def _commands(name: str) -> bool:
    """Whether a stream is that of the commands, of all joints or of one."""
    return name.rpartition(".")[2] == COMMAND
