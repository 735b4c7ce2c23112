# SPDX-License-Identifier: BSD-3-Clause
"""What the neighbours of samples say about them: a cubic through two on either side, and the smallest changes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDING = 1e-12  # of the largest value


def off_neighbours(times: Array, column: Array, length: int = 1) -> Array:
    """How far runs of samples lie from what their neighbours say.

    Args:
        times: increasing, shape (n,) [s].
        column: one channel, shape (n,).
        length: samples per run, 1 or more.

    Returns:
        Smallest distance within the run that begins at each sample, with the sign of its first, shape (n,); zero where
        there are not two neighbours on either side.
    """
    n = len(times)
    off = np.zeros(n)
    begin = np.arange(2, n - 1 - length)
    if not len(begin):
        return off
    nodes = [begin - 2, begin - 1, begin + length, begin + length + 1]
    distances = []
    for place in range(length):
        at = times[begin + place]
        predicted = np.zeros(len(begin))
        for node in nodes:
            weight = np.ones(len(begin))
            for other in nodes:
                if other is not node:
                    weight *= (at - times[other]) / (times[node] - times[other])
            predicted += weight * column[node]
        distances.append(column[begin + place] - predicted)
    smallest = np.min(np.abs(distances), axis=0)
    off[begin] = np.sign(distances[0]) * smallest
    return off


def smallest_changes(values: Array) -> Array:
    """Smallest change of each channel from one sample to the next that is no rounding, shape (m,); infinite for none.

    Args:
        values: shape (n, m).
    """
    steps = np.abs(np.diff(values, axis=0))
    rounding = ROUNDING * np.abs(values).max(axis=0, initial=0.0)
    return np.array([column[column > r].min(initial=np.inf) for column, r in zip(steps.T, rounding, strict=True)])
