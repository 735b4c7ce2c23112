# SPDX-License-Identifier: BSD-3-Clause
r"""Drives whose limit is another one forwards than backwards, or falls with speed, as that of a voltage does.

A drive with a supply of U volts, a resistance R and a back-EMF of K volts s/rad gives at the most currents between

    -(U + K v) / R  and  (U - K v) / R,

so the faster it goes, the less it can push on, and the more it can brake. The limits tried are

    u_acting = clip(u, -lower - slope v, upper - slope v),

with both levels and the slope where motion leaves least of the limited command open, as in `command_limits`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.command_limits import (
    MOVES,
    OPEN,
    CommandLimit,
    DrivenWindows,
    dry_friction,
    left_open,
    limits_in,
    windows_of_drives,
)
from jointscope.graphs.starts.drive_regression import Driven
from jointscope.robots.bodies.rigid_tree import RigidTree

Array = NDArray[np.float64]

WIDTH = 0.12  # [s] of windows
TRIED = (0.5, 0.6, 0.7, 0.8, 0.88, 0.93, 0.97, 0.985, 0.995)  # quantiles of the commands of one sign
SLOPES = (0.0, 0.1, 0.25, 0.5, 0.9)  # share of the larger level that is gone at the largest speed
LOWEST, EVEN = 0.3, 12  # quantile of the smallest even level, and how many are tried in each round
ROUNDS = 4  # over levels and slope, each with half the step of the one before
STEP = 0.3  # relative, of the first round
BETTER = 5.0  # times less is left open than without limits, and ...
THAN_ONE = 2.0  # ... than with one level for both directions and all speeds
MATTERS = 1e-4  # of the mean square that is left open, below which nothing is missing
FEWEST = 20  # commands beyond the limits
FEWEST_ROWS = 60  # windows


@dataclass(frozen=True)
class UnevenLimit:
    """What one drive gives at the most.

    Attributes:
        lower, upper: levels backwards and forwards at rest, in the unit of the command; infinite for none.
        slope: by how much both move against the speed, in the unit of the command per rad/s.
        falls: share of the larger level that is gone at the largest speed.
        share: of the commands that are beyond.
        beyond: from and to of the commands beyond, of each recording [s].
    """

    lower: float
    upper: float
    slope: float
    falls: float
    share: float
    beyond: tuple[tuple[tuple[float, float], ...], ...]


def uneven_limit(windows: Sequence[DrivenWindows], joint: int) -> UnevenLimit | None:
    """The limits of one drive; None where none shows, or one level for both directions and all speeds does as well.

    Args:
        windows: of each recording, of one width.
        joint: index.
    """
    if sum(len(some.motion[joint]) for some in windows) < FEWEST_ROWS:
        return None
    parts = [_Commands.of(some, joint) for some in windows]
    u = np.concatenate([part.u for part in parts])
    if not ((u > 0.0).any() and (u < 0.0).any()):
        return None

    def open_with(limits: Array) -> float:
        return left_open(windows, joint, [part.limited(*limits) for part in parts])

    whole = open_with(np.array([np.inf, np.inf, 0.0]))
    if whole < MATTERS:
        return None
    fastest = max(float(np.max(np.abs(part.v))) for part in parts)
    best, left = _best(open_with, _starts(u, fastest), fastest)
    even = _best_even(open_with, u)
    beyond = [part.u != part.limited(*best) for part in parts]
    count = sum(int(np.count_nonzero(flags)) for flags in beyond)
    if BETTER * left > whole or THAN_ONE * left > even or left > OPEN or count < FEWEST:
        return None
    levels = [
        level for level, sign in zip(best[:2], (-1, 1), strict=True) if np.isfinite(level) and np.any(sign * u > 0.0)
    ]
    dry = dry_friction(windows, joint, [part.limited(*best) for part in parts])
    if not levels or dry > MOVES * min(levels):
        return None
    stretches = tuple(_stretches(part.times, flags) for part, flags in zip(parts, beyond, strict=True))
    lower, upper = (level if np.any(sign * u > 0.0) else np.inf for level, sign in zip(best[:2], (-1, 1), strict=True))
    falls = float(best[2]) * fastest / max(x for x in (lower, upper) if x < np.inf)
    return UnevenLimit(float(lower), float(upper), float(best[2]), falls, count / len(u), stretches)


def even_limits(tree: RigidTree, recordings: Sequence[Driven], sigmas: Array) -> list[CommandLimit | None]:
    """As `command_limits`, but None where the limit differs between directions or falls with speed."""
    windows = windows_of_drives(tree, recordings, sigmas)
    found = enumerate(limits_in(windows, tree.n))
    return [None if limit and uneven_limit(windows[WIDTH], joint) else limit for joint, limit in found]


@dataclass(frozen=True)
class _Commands:
    """Commands of one joint in one recording, with the speed at their stamps."""

    times: Array
    u: Array
    v: Array

    @staticmethod
    def of(windows: DrivenWindows, joint: int) -> _Commands:
        own, cells = windows.command.channel(joint), windows.cells
        period = float(np.median(np.diff(own.times)))
        middle = own.times + (0.5 * period if windows.held else 0.0)
        v = np.interp(middle, cells.edges, cells.v_smooth[:, joint])
        return _Commands(own.times, own.values[:, 0], v)

    def limited(self, lower: float, upper: float, slope: float) -> Array:
        """What the drive gave; a limit beyond the other side gives nothing."""
        high = np.maximum(upper - slope * self.v, 0.0)
        low = np.minimum(-lower - slope * self.v, 0.0)
        return np.clip(self.u, low, high)


def _starts(u: Array, fastest: float) -> list[Array]:
    upper = [np.inf, *np.quantile(u[u > 0.0], TRIED)]
    lower = [np.inf, *np.quantile(-u[u < 0.0], TRIED)]
    both = [np.array([a, b, 0.0]) for a in lower for b in upper]
    largest = float(np.max(np.abs(u)))
    falling = [
        np.array([level, level, share * level / fastest])
        for level in largest * np.array([0.3, 0.5, 0.7, 0.9, 1.2])
        for share in SLOPES[1:]
    ]
    return both + falling


def _best(open_with: Callable[[Array], float], starts: Sequence[Array], fastest: float) -> tuple[Array, float]:
    """The limits that leave least open, by turns, from the best of some starts."""
    best = min(starts, key=open_with)
    left, step = open_with(best), STEP
    for _ in range(ROUNDS):
        for _ in range(3):
            before = left
            for i in range(3):
                for change in (1.0 + step, 1.0 / (1.0 + step)):
                    trial = best.copy()
                    trial[i] *= change
                    if i == 2 and best[2] == 0.0:
                        trial[2] = (change - 1.0) * min(best[:2].min(), 1e300) / fastest if change > 1.0 else 0.0
                    if np.all(np.isfinite(trial[2:])) and (found := open_with(trial)) < left:
                        best, left = trial, found
            if left > 0.99 * before:
                break
        step *= 0.35
    return best, left


def _best_even(open_with: Callable[[Array], float], u: Array) -> float:
    """What the best level for both directions and all speeds leaves open."""
    sizes = np.abs(u[u != 0.0])
    levels, least = np.geomspace(float(np.quantile(sizes, LOWEST)), float(sizes.max()), EVEN), np.inf
    for _ in range(ROUNDS):
        found = [open_with(np.array([level, level, 0.0])) for level in levels]
        k, least = int(np.argmin(found)), min(least, *found)
        levels = np.geomspace(levels[max(k - 1, 0)], levels[min(k + 1, EVEN - 1)], EVEN)
    return least


def _stretches(times: Array, flags: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """From and to of runs of flagged stamps [s]; the last command of a run acts until the next stamp."""
    change = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    ends = np.append(times, times[-1])
    return tuple((float(times[a]), float(ends[b])) for a, b in change.reshape(-1, 2))
