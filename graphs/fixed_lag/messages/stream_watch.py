# SPDX-License-Identifier: BSD-3-Clause
"""Which streams have fallen silent, and whether the encoders still fit."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.fixed_lag.messages.status import EventLog
from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.robots.model.robot import Robot

SILENT = 0.1  # [s] or
PERIODS = 20.0  # usual distances of a stream's samples, whichever is longer
SHARE = 0.05  # weight of a new distance in the running estimate of the usual one
EVERY = 10  # ticks between two looks
CONTRADICTION = 30.0**2  # normalised innovation squared of the encoders per degree of freedom
LONGEST_CONTRADICTION = 0.1  # [s]


class StreamWatch:
    """Remembers when each stream was last heard of.

    Args:
        robot: its encoders.
        log: receives events.
    """

    def __init__(self, robot: Robot, log: EventLog):
        self._log, self._encoder = log, robot.motor_encoder.name
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
                kind = "command_back" if name == "command" else "sensor_back"
                self._log.tell(t, kind, name, f"{name} is back after {silence:.2f} s")

    def check(self, now: float) -> tuple[str, ...]:
        """Streams that are silent; looks at them every few ticks."""
        self._ticks += 1
        if self._ticks % EVERY == 0:
            for name, last in self._last.items():
                if name not in self._lost and now - last > self._patience(name):
                    self._lost[name] = last
                    kind = "command_lost" if name == "command" else "sensor_lost"
                    self._log.tell(now, kind, name, f"nothing of {name} since {last:.3f} s")
        return tuple(self._lost)

    def command_is_lost(self, now: float) -> bool:
        """Whether commands have stopped; the robot may then do what its drives do without one."""
        last = self._last.get("command")
        return last is not None and now - last > self._patience("command")

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
