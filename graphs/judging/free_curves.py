# SPDX-License-Identifier: BSD-3-Clause
"""Curves that no law restricts, over position and over speed: the most that a smooth law could explain.

They are linear between a few knots at quantiles of the motion; more knots run away where it has hardly been.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KNOTS, SPEED_KNOTS = 8, 5


def hats(x: Array, knots: int = KNOTS) -> Array:
    """Linear interpolation between knots at quantiles, shape (m, knots)."""
    at = np.unique(np.quantile(x, np.linspace(0.0, 1.0, knots)))
    return np.column_stack([np.interp(x, at, unit) for unit in np.eye(len(at))])


def over_speed(v: Array) -> Array:
    """Friction of either direction over the root of the speed, shape (m, 2 SPEED_KNOTS)."""
    parts = [np.where((v > 0.0) == forward, 1.0, 0.0) for forward in (True, False)]
    return np.hstack([part[:, None] * hats(np.sqrt(np.abs(v)), SPEED_KNOTS) for part in parts])


def stacked(columns: Sequence[Array]) -> Array:
    """Columns of their own for every equation, shape (m of all, k of all)."""
    total, start = np.zeros((sum(len(c) for c in columns), sum(c.shape[1] for c in columns))), [0, 0]
    for c in columns:
        total[start[0] : start[0] + len(c), start[1] : start[1] + c.shape[1]] = c
        start = [start[0] + len(c), start[1] + c.shape[1]]
    return total
