# SPDX-License-Identifier: BSD-3-Clause
"""What the neighbours of samples say about them: whether they lie between them, and how finely a channel changes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EITHER_SIDE = 2  # neighbours that are looked at
ROUNDING = 1e-12  # of the largest value


def beyond_neighbours(column: Array, length: int = 1) -> Array:
    """How far runs of samples lie outside the range of their neighbours.

    No time enters: stamps of real drivers come in bunches, and a curve through bunched points swings.

    Args:
        column: one channel in the order of its stamps, shape (n,).
        length: samples per run, 1 or more.

    Returns:
        The smallest distance within the run that begins at each sample, shape (n,); zero where all of it is not
        outside, or where there are not two neighbours on either side.
    """
    n = len(column)
    beyond = np.zeros(n)
    begin = np.arange(EITHER_SIDE, n - EITHER_SIDE - length + 1)
    if not len(begin):
        return beyond
    offsets = [*range(-EITHER_SIDE, 0), *range(length, length + EITHER_SIDE)]
    around = np.stack([column[begin + offset] for offset in offsets])
    inside = np.stack([column[begin + place] for place in range(length)])
    above, below = inside.min(axis=0) - around.max(axis=0), around.min(axis=0) - inside.max(axis=0)
    beyond[begin] = np.maximum(np.maximum(above, below), 0.0)
    return beyond


def smallest_changes(values: Array) -> Array:
    """Smallest change of each channel from one sample to the next that is no rounding, shape (m,); infinite for none.

    Args:
        values: shape (n, m).
    """
    steps = np.abs(np.diff(values, axis=0))
    rounding = ROUNDING * np.abs(values).max(axis=0, initial=0.0)
    return np.array([column[column > r].min(initial=np.inf) for column, r in zip(steps.T, rounding, strict=True)])
