# SPDX-License-Identifier: BSD-3-Clause
"""Cuts a recording into stretches in which nothing leaves its range, sample by sample, in machine code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def ends_of_stretches(times: Array, values: Array, within: Array, pause: float) -> NDArray[np.intp]:
    """Where the next stretch begins: a channel would leave its range, or samples are missing.

    Args:
        times: shape (k,) [s].
        values: shape (k, c).
        within: range of each channel, shape (c,).
        pause: time without a sample that ends a stretch [s].

    Returns:
        One past the last sample of each of the m stretches, shape (m,).
    """
    found = np.empty(len(times), dtype=np.intp)
    low, high = values[0].copy(), values[0].copy()
    many = 0
    for k in range(1, len(times)):
        over = times[k] - times[k - 1] > pause
        for c in range(values.shape[1]):
            over = over or max(high[c], values[k, c]) - min(low[c], values[k, c]) > within[c]
        for c in range(values.shape[1]):
            low[c] = values[k, c] if over else min(low[c], values[k, c])
            high[c] = values[k, c] if over else max(high[c], values[k, c])
        if over:
            found[many] = k
            many += 1
    found[many] = len(times)
    return found[: many + 1]
