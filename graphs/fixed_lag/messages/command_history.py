# SPDX-License-Identifier: BSD-3-Clause
"""The commands of the last while, whatever the order in which they came, and what acts of them in a step.

A command acts from its stamp until the next one; a measured drive signal is linear between its samples. Effects
on commands (delays, lags, dead bands) need the history; a history of half a second holds all that a delay or a lag of
the catalogue reaches back to.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left, bisect_right
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

KEPT = 0.5  # [s] of history beyond the lag where effects need it
RECENT = 41  # commands whose distances tell the period
EVERY = 10  # commands after which the period is measured again
SHORTEST = 2e-5  # [s] two commands that are nearer are one that was sent twice
CHANGE_SHARE = 5e-4  # weight of a new change in the mean square of changes: the last two thousand commands
HELD_IN_DOUBT = 0.05  # [s] how long a wrong torque lasts where commands have stopped
SAME_TIME = 1e-6  # [s]


class CommandHistory:
    """Commands in the order of their stamps.

    Args:
        robot: for its effects and number of joints.
        lag: length of the estimator's window [s].

    Attributes:
        period: usual distance between two commands [s]; infinite before the second.
        typical_change: root mean square change from one command to the next, shape (n,) [unit of the command].
    """

    def __init__(self, robot: Robot, lag: float):
        self._robot, self._effects, self._held = robot, robot.effects, robot.command_held
        probe = CommandPath(np.array([0.0, 1.0]), np.zeros((1, robot.n)), robot.effects, robot.joints)
        self._changes = probe.changes
        self._kept = lag + KEPT
        self._values: Mapping[str, float] = robot.values
        self._times: list[float] = []
        self._u: list[Array] = []
        self._about: list[NDArray[np.bool_] | None] = []
        self._own_periods: Array | None = None  # of each joint, once messages are about some joints only
        self.period = float("inf")
        # as if one of two thousand commands so far had jumped to the full one
        self.typical_change = np.full(robot.n, math.sqrt(CHANGE_SHARE) * _full_command(robot))
        self._added = 0

    def __len__(self) -> int:
        return len(self._times)

    def add(self, t: float, u: Array, about: NDArray[np.bool_] | None = None) -> None:
        """Takes in a command of all joints; it may be older than others, and new only for those that it is `about`."""
        i = bisect_right(self._times, t)
        if i == len(self._times) and i:
            self._learn(u - self._u[-1], about)
        self._times.insert(i, t)
        self._u.insert(i, u)
        self._about.insert(i, about)
        if about is not None and self._own_periods is None:
            self._own_periods = np.full(self._robot.n, np.inf)
        self._added += 1
        if self._added <= RECENT or self._added % EVERY == 0:
            self._measure_period()
        while len(self._times) > 2 and self._times[1] < self._times[-1] - self._kept:
            del self._times[0], self._u[0], self._about[0]

    def mean(self, t0: float, t1: float) -> Array:
        """Mean command that acts between two times, effects included, shape (n,); zero before the first command."""
        if not self._times or t1 <= self._times[0]:
            return np.zeros(self._robot.n)
        first = max(bisect_right(self._times, t0) - 1, 0)
        last = bisect_left(self._times, t1)  # first command that acts only later
        if self._changes:
            return self._after_effects(t0, t1, last)
        if not self._held:
            knots = np.array([t0, *(t for t in self._times[first:last] if t > t0), t1])
            return np.diff(knots) @ self._between(knots, first, last) / (t1 - t0)
        if last - first == 1 and t0 >= self._times[first]:
            return self._u[first]
        edges = np.array([*self._times[first:last], t1])
        edges[:-1] = np.maximum(edges[:-1], t0)
        before = max(self._times[0] - t0, 0.0)
        weights = np.diff(edges)
        return weights @ np.array(self._u[first:last]) / (weights.sum() + before)

    def acting(self, t0: float, t1: float) -> tuple[Array, Array | None]:
        """Mean command between two times, and its standard deviation where commands are missing, shape (n,) each."""
        u, missing = self.mean(t0, t1), self.doubt(t0, t1)
        return (u, None) if missing is None else (u + missing[0], missing[1])

    def lost(self, t0: float, t1: float) -> tuple[Array, Array]:
        """As `acting` where commands have stopped: drives may do anything between holding the last one and nothing."""
        u = self.mean(t0, t1)
        return u, (np.abs(u) + self.typical_change) * math.sqrt(HELD_IN_DOUBT / (t1 - t0))

    def doubt(self, t0: float, t1: float) -> tuple[Array, Array] | None:
        """What a command that should have come between t0 and t1, but did not, leaves open.

        It lay somewhere between the commands before and after it. Where there is none after it, it was like the one
        before, give or take the usual change.

        Returns:
            Expected change of the mean command of the step, and its standard deviation, shape (n,) each; None where
            nothing is missing.
        """
        if self._own_periods is None:
            return self._doubt(self._times, self._u, self.period, self.typical_change, t0, t1)
        moved, sigma, complete = np.zeros_like(self.typical_change), np.zeros_like(self.typical_change), True
        for j, period in enumerate(self._own_periods):
            own = self._own(j)
            u = [self._u[i][[j]] for i in own]
            found = self._doubt([self._times[i] for i in own], u, float(period), self.typical_change[[j]], t0, t1)
            if found is not None:
                moved[j], sigma[j], complete = found[0][0], found[1][0], False
        return None if complete else (moved, sigma)

    def _doubt(
        self, times: list[float], commands: list[Array], period: float, typical_change: Array, t0: float, t1: float
    ) -> tuple[Array, Array] | None:
        """As `doubt`, of joints whose commands come together."""
        first = bisect_right(times, t0 + SAME_TIME) - 1
        if first < 0 or not math.isfinite(period):
            return None
        last = bisect_left(times, t1 - SAME_TIME)
        moved, variance, complete = np.zeros_like(typical_change), np.zeros_like(typical_change), True
        for i in range(first, last):
            following = times[i + 1] if i + 1 < len(times) else math.inf
            begin = times[i] + period
            missing = min(t1, following) - max(t0, begin)
            if missing < 0.5 * period:
                continue
            complete, share = False, missing / (t1 - t0)
            # one unknown command acts in all steps of the gap: their errors do not average out
            together = max(min(following, t1) - begin, missing) / missing
            if math.isinf(following):
                variance += together * (share * typical_change) ** 2
            else:
                change = commands[i + 1] - commands[i]
                if self._held:  # else the mean goes to the one after it by itself
                    way = max(t0, begin) + 0.5 * missing - 0.5 * period - times[i]
                    moved += share * way / (following - times[i]) * change
                variance += together * (share * change) ** 2 / 12.0
        return None if complete else (moved, np.sqrt(variance))

    def unsure_since(self, t: float) -> float:
        """From when on the command with stamp t [s] changes what acted: where the one before it was due to end.

        A measured one tells what acted since the one before it.
        """
        i = bisect_left(self._times, t)
        before, period = self._times[i - 1] if i else None, self.period
        about = self._about[i] if i < len(self._times) else None
        if self._own_periods is not None and about is not None:
            j = int(np.argmax(about))
            before = next((self._times[k] for k in reversed(self._own(j)) if self._times[k] < t), None)
            period = float(self._own_periods[j])
        if before is None:
            return t
        if not self._held:
            return before
        due = before + period
        return due if t - due > 0.5 * period else t

    def acts_until(self, t: float) -> float:
        """When the command that acts at a time is replaced by the next one [s]; infinity for the last."""
        i = bisect_right(self._times, t)
        reach = self._kept if self._changes else 0.0
        return self._times[i] + reach if i < len(self._times) else float("inf")

    def forget_after(self, t: float) -> None:
        """Forgets commands with later stamps, which cannot be right."""
        i = bisect_right(self._times, t)
        del self._times[i:], self._u[i:], self._about[i:]

    def _own(self, joint: int) -> list[int]:
        """Which commands are about a joint, in the order of time."""
        return [i for i, about in enumerate(self._about) if about is None or about[joint]]

    def _measure_period(self) -> None:
        """The median distance; lost commands make some distances longer, and the newest may not have come yet."""
        if self._own_periods is None:
            self.period = _middle_distance(self._times[-RECENT:], self.period)
            return
        for j, period in enumerate(self._own_periods):
            recent = [self._times[i] for i in self._own(j)[-RECENT:]]
            self._own_periods[j] = _middle_distance(recent, float(period))
        self.period = float(self._own_periods.min())

    def _learn(self, change: Array, about: NDArray[np.bool_] | None) -> None:
        # rare jumps dominate, and are what a missing command may have been
        mean_square = self.typical_change**2
        learned = np.sqrt(mean_square + CHANGE_SHARE * (change**2 - mean_square))
        self.typical_change = learned if about is None else np.where(about, learned, self.typical_change)

    def _after_effects(self, t0: float, t1: float, last: int) -> Array:
        """As `mean`, with the effects on commands."""
        inner = [t for t in self._times[:last] if t < t0]
        edges = np.array(
            [
                *inner,
                *([t0] if not inner or inner[-1] < t0 else []),
                *(t for t in self._times[len(inner) : last] if t > t0),
                t1,
            ]
        )
        index = np.maximum(np.searchsorted(self._times, edges[:-1], side="right") - 1, 0)
        acted = np.array(self._u)[index] if self._held else self._between(edges, 0, last)
        path = CommandPath(edges, acted, self._effects, self._robot.joints)
        u, h = path.acting(self._values)[0], np.diff(edges)
        own = edges[:-1] >= t0
        return h[own] @ u[own] / h[own].sum()

    def _between(self, knots: Array, first: int, last: int) -> Array:
        """Means from knot to knot of a signal that is linear between its samples, those from first to last [incl.]."""
        u = np.array(self._u[first : last + 1])
        at = np.column_stack([np.interp(knots, self._times[first : last + 1], column) for column in u.T])
        return np.asarray(0.5 * (at[1:] + at[:-1]), dtype=np.float64)


def _middle_distance(times: list[float], otherwise: float) -> float:
    """Median distance of times; the lower one of two."""
    distances = sorted(b - a for a, b in itertools.pairwise(times) if b - a > SHORTEST)
    return distances[(len(distances) - 1) // 2] if distances else otherwise


def _full_command(robot: Robot) -> float:
    """The largest command where it is known, else zero [unit of the command]."""
    if robot.command.unit == "duty":
        return 1.0
    return float(robot.constants.get("motor.supply_voltage", 0.0)) if robot.command.unit == "V" else 0.0
