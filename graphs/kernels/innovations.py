# SPDX-License-Identifier: BSD-3-Clause
"""Values made independent of those before them, where errors have an exponential memory and a white part.

The Kalman filter of cov(t, t') = exp(-|t - t'| / T) + r^2 [t = t'] gives what L^-1 of its Cholesky factor gives, in a
time that is linear in the rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def innovations(
    times: Array, values: Array, blocks: NDArray[np.intp], memory: float, white: float
) -> tuple[Array, float]:
    """Whitened values, shape (m, k), and the sum of the logarithms of the deviations by which they were divided.

    Args:
        times: ascending in every block, shape (m,) [s].
        values: shape (m, k).
        blocks: of each row, shape (m,); the rows of one stand together, and nothing is remembered from one to the next.
        memory: T [s].
        white: r.
    """
    m, k = values.shape
    found, expected = np.empty((m, k)), np.zeros(k)
    variance, logarithms = 1.0, 0.0
    for i in range(m):
        if i == 0 or blocks[i] != blocks[i - 1]:
            variance, expected[:] = 1.0, 0.0
        else:
            keep = np.exp(-(times[i] - times[i - 1]) / memory)
            variance = keep * keep * variance + 1.0 - keep * keep
            expected *= keep
        total = variance + white * white
        deviation, gain = np.sqrt(total), variance / total
        for j in range(k):
            innovation = values[i, j] - expected[j]
            found[i, j] = innovation / deviation
            expected[j] += gain * innovation
        variance -= gain * variance
        logarithms += np.log(deviation)
    return found, logarithms
