# SPDX-License-Identifier: BSD-3-Clause
"""A second node that repeats commands which are held: for a while after each new level it still sends the one before.

Messages of one level are all alike, so that none is a copy by its digits. The sign is at the changes: once the driver
has begun a new level, the old one comes back again and again, between messages of the new one, and after every change
for about as long. A command that trembles between two steps of its digits comes back, too, but for as long as it likes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Flags = NDArray[np.bool_]

FEWEST = 5  # changes of level
ALIKE = 0.9  # share of all repetitions, or of all changes, that come, or are followed by one, about as late as is usual
LATEST = 1.0  # [s] after the driver, at which a second node may still repeat it
SPREAD = 0.15  # of how late is usual; a signal that turns round repeats itself earlier and later, too
HELD = 2.0  # times as long as old levels come, a level lasts at least
IN_A_ROW = 3  # messages of an old level by which the driver itself has returned to it


@dataclass
class _Level:
    """One level of the driver: which value, from when until the next one [s], and the messages that came after that."""

    value: int
    began: float
    ended: float = np.inf
    stale: list[int] = field(default_factory=list)


def stale_levels(stamps: NDArray[np.int64], values: NDArray[np.float64]) -> tuple[Flags, float]:
    """Which messages repeat a level that the driver has left, shape (n,), and for how long they do [s].

    None where it may be chance.

    Args:
        stamps: in order, shape (n,) [ns].
        values: shape (n, m).
    """
    none = np.zeros(len(values), bool), 0.0
    if len(values) < FEWEST or not values.shape[1]:
        return none
    returns = np.all(values[2:] == values[:-2], axis=1) & np.any(values[2:] != values[1:-1], axis=1)
    if np.count_nonzero(returns) < FEWEST:  # before anything is sorted: nearly all streams end here
        return none
    which = np.unique(values, axis=0, return_inverse=True)[1].ravel()
    at = (stamps - stamps[0]) / 1e9
    usual = _lateness(at, _levels(at, which, LATEST))
    if usual is None:
        return none
    levels = _levels(at, which, usual)
    if _lateness(at, levels) is None:
        return none
    stale = np.zeros(len(values), bool)
    for level in levels:
        stale[level.stale] = True
    return stale, usual


def _levels(at: NDArray[np.float64], which: NDArray[np.intp], latest: float) -> list[_Level]:
    """The levels of the driver in their order, where an old one that comes within `latest` [s] is a repetition."""
    levels, recent, row = [_Level(int(which[0]), float(at[0]))], dict[int, _Level](), 0
    for i in range(1, len(which)):
        now, value = levels[-1], int(which[i])
        if value == now.value:
            row = 0
            continue
        old = recent.get(value)
        row = row + 1 if value == which[i - 1] else 1
        if old is not None and at[i] - old.ended < latest and row < IN_A_ROW:
            old.stale.append(i)
            continue
        begun = i
        if old is not None and old.stale and row >= IN_A_ROW:  # it was the driver that came back
            begun = i - IN_A_ROW + 1
            old.stale = [k for k in old.stale if k < begun]
        now.ended = float(at[begun])
        recent[now.value] = now
        levels.append(_Level(value, now.ended))
        row = 0
    return levels


def _lateness(at: NDArray[np.float64], levels: list[_Level]) -> float | None:
    """How long after each change old levels come [s]; None where they do not come alike after nearly all."""
    left = levels[:-1]
    told = [level for level in left if level.stale]
    if len(left) < FEWEST or len(told) < ALIKE * len(left):
        return None
    after = np.array([at[level.stale[-1]] - level.ended for level in told])
    usual = float(np.median(after))
    if np.median([level.ended - level.began for level in left]) < HELD * usual:
        return None
    spacing = usual / float(np.median([len(level.stale) for level in told]))
    alike = np.abs(after - usual) < max(spacing, SPREAD * usual)
    return usual + spacing if np.count_nonzero(alike) >= ALIKE * len(left) else None
