# SPDX-License-Identifier: BSD-3-Clause
"""A Kalman filter in information form over steps that are linear already: predict, update, drop the old state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def filter_steps(
    H: Array, g: Array, around: Array, ahead: Array, mean: Array, information: Array
) -> tuple[Array, Array, bool]:
    """Means, shape (m + 1, d), and informations, shape (m + 1, d, d), and whether all steps could be taken.

    Args:
        H: Hessian of what each of m steps adds, on the old and the new state, shape (m, 2 d, 2 d).
        g: its gradient there, shape (m, 2 d).
        around: old states around which the steps are linear, shape (m + 1, d).
        ahead: new states around which they are, shape (m, d).
        mean: of the first state, shape (d,).
        information: of the first state, shape (d, d).
    """
    m, d = ahead.shape
    means, informations = np.empty((m + 1, d)), np.empty((m + 1, d, d))
    means[0], informations[0] = mean, information
    A, b, scale = np.empty((2 * d, 2 * d)), np.empty(2 * d), np.empty(2 * d)
    for k in range(m):
        for i in range(2 * d):
            b[i] = g[k, i]
            for j in range(i + 1):
                A[i, j] = H[k, i, j]
        for i in range(d):
            for j in range(d):
                b[i] += informations[k, i, j] * (around[k, j] - means[k, j])
            for j in range(i + 1):
                A[i, j] += informations[k, i, j]
        # rows differ by ten orders of magnitude
        for i in range(2 * d):
            if not A[i, i] > 0.0:
                return means, informations, False
            scale[i] = 1.0 / np.sqrt(A[i, i])
        for i in range(2 * d):
            b[i] *= scale[i]
            for j in range(i + 1):
                A[i, j] *= scale[i] * scale[j]
        # Cholesky factor and forward substitution, row by row; after d rows the rest is what the new state knows
        for c in range(d):
            if not A[c, c] > 0.0:
                return means, informations, False
            root = np.sqrt(A[c, c])
            b[c] /= root
            for i in range(c + 1, 2 * d):
                A[i, c] /= root
                b[i] -= A[i, c] * b[c]
            for i in range(c + 1, 2 * d):
                for j in range(c + 1, i + 1):
                    A[i, j] -= A[i, c] * A[j, c]
        for i in range(d):
            for j in range(i + 1):
                informations[k + 1, i, j] = A[d + i, d + j] / (scale[d + i] * scale[d + j])
                informations[k + 1, j, i] = informations[k + 1, i, j]
        for c in range(d, 2 * d):
            if not A[c, c] > 0.0:
                return means, informations, False
            root = np.sqrt(A[c, c])
            A[c, c] = root
            b[c] /= root
            for i in range(c + 1, 2 * d):
                A[i, c] /= root
                b[i] -= A[i, c] * b[c]
            for i in range(c + 1, 2 * d):
                for j in range(c + 1, i + 1):
                    A[i, j] -= A[i, c] * A[j, c]
        for i in range(2 * d - 1, d - 1, -1):
            for j in range(i + 1, 2 * d):
                b[i] -= A[j, i] * b[j]
            b[i] /= A[i, i]
            means[k + 1, i - d] = ahead[k, i - d] - b[i] * scale[i]
    return means, informations, True
