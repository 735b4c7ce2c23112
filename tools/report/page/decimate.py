# SPDX-License-Identifier: BSD-3-Clause
"""Long curves with fewer points that look the same: smallest and largest value of every stretch are kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POINTS = 1500  # about one and a half per pixel of a wide plot


def min_max(x: Array, y: Array, points: int = POINTS) -> tuple[Array, Array]:
    """A curve with at most about `points` points and the same outline.

    Args:
        x: abscissa, increasing, shape (m,).
        y: ordinate, NaN where the curve is interrupted, shape (m,).
        points: number of points wanted.

    Returns:
        Some of the points, in order.
    """
    if len(x) <= points:
        return x, y
    size = -(-len(x) // (points // 2))
    whole = len(x) // size * size
    blocks = y[:whole].reshape(-1, size)
    broken = np.isnan(blocks)
    start = np.arange(len(blocks)) * size
    lowest = start + np.argmin(np.where(broken, np.inf, blocks), axis=1)
    highest = start + np.argmax(np.where(broken, -np.inf, blocks), axis=1)
    # a stretch that is interrupted anywhere must stay interrupted, or the pen would cross the hole
    hole = start[broken.any(axis=1)] + np.argmax(broken[broken.any(axis=1)], axis=1)
    keep = np.unique(np.concatenate([[0], lowest, highest, hole, np.arange(whole, len(x))]))
    return x[keep], y[keep]


def thin(x: Array, *ys: Array, points: int = POINTS) -> tuple[Array, ...]:
    """Evenly chosen points of smooth curves (limits of a band)."""
    keep = np.unique(np.linspace(0, len(x) - 1, min(points, len(x))).astype(int))
    return (x[keep], *(y[keep] for y in ys))
