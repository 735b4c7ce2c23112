# SPDX-License-Identifier: BSD-3-Clause
"""Products of the Jacobians of one factor added where they belong, sample by sample, without arrays between."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.kernels.compiled import compiled

Array = NDArray[np.float64]


@compiled
def add_products(
    J: Array, right: Array, D: Array, B: Array, g: Array, states: NDArray[np.intp], places: NDArray[np.intp]
) -> None:
    """Adds J' J to D, J' P to B and J' r to g, in the order of the samples.

    Args:
        J: whitened Jacobians by one state, shape (m, r, d).
        right: whitened Jacobians P by shared values, then the residual, shape (m, r, q + 1).
        D: diagonal blocks, shape (n, d, d).
        B: border, shape (n, d, p).
        g: gradient, shape (n, d).
        states: state of each sample, shape (m,); one may come several times.
        places: columns of the border of the q shared values.
    """
    m, rows, d = J.shape
    q = right.shape[2] - 1
    square, border = np.empty((d, d)), np.empty((d, q + 1))
    for k in range(m):
        square[:], border[:] = 0.0, 0.0
        for r in range(rows):
            for i in range(d):
                x = J[k, r, i]
                if x != 0.0:  # most of a measurement's Jacobian is zero
                    for j in range(d):
                        square[i, j] += x * J[k, r, j]
                    for c in range(q + 1):
                        border[i, c] += x * right[k, r, c]
        t = states[k]
        for i in range(d):
            for j in range(d):
                D[t, i, j] += square[i, j]
            for c in range(q):
                B[t, i, places[c]] += border[i, c]
            g[t, i] += border[i, q]
