# SPDX-License-Identifier: BSD-3-Clause
"""Cholesky factorisation of a block tridiagonal chain, the border solved along, in one pass over the ticks.

    A(k) = D(k) - X(k-1) X(k-1)',   L(k) L(k)' = A(k),   X(k) = E(k) L(k)^-T
    W(k) = L(k)^-1 (W(k) - X(k-1) W(k-1))

The columns of the border are the innermost loop: it runs over neighbours in memory. What a tick needs of the one
before is still in the cache, unlike with one LAPACK call after the other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def factorise(D: Array, E: Array, scale: Array, columns: Array, W: Array) -> int:
    """Factorises the chain and solves for the border in place.

    Args:
        D: diagonal blocks, of which the lower triangle is read, shape (m, d, d).
        E: blocks below the diagonal, shape (m - 1, d, d).
        scale: factor on the diagonal of each tick, shape (m,).
        columns: takes L, the lower band column by column, zeros before, shape (m, d, 2d).
        W: the border, which becomes L^-1 times it, shape (m, d, p).

    Returns:
        0, or one more than the index of the first pivot that is not positive.
    """
    m, d, p = W.shape
    A, L, X = np.empty((d, d)), np.zeros((d, d)), np.zeros((d, d))
    inverse = np.empty(d)
    for k in range(m):
        for i in range(d):
            for j in range(i):
                A[i, j] = D[k, i, j]
            A[i, i] = D[k, i, i] * scale[k]
        if k > 0:
            for i in range(d):
                for j in range(d):
                    v = E[k - 1, i, j]
                    for c in range(j):
                        v -= X[i, c] * L[j, c]
                    v *= inverse[j]
                    X[i, j] = v
                    columns[k - 1, j, d - j + i] = v
            for i in range(d):
                for j in range(i + 1):
                    v = A[i, j]
                    for c in range(d):
                        v -= X[i, c] * X[j, c]
                    A[i, j] = v
                for c in range(d):
                    x = X[i, c]
                    for q in range(p):
                        W[k, i, q] -= x * W[k - 1, c, q]
        for j in range(d):
            v = A[j, j]
            for c in range(j):
                v -= L[j, c] * L[j, c]
            if v <= 0.0:
                return k * d + j + 1
            root = np.sqrt(v)
            L[j, j] = root
            inverse[j] = 1.0 / root
            columns[k, j, 0] = root
            for i in range(j + 1, d):
                v = A[i, j]
                for c in range(j):
                    v -= L[i, c] * L[j, c]
                v *= inverse[j]
                L[i, j] = v
                columns[k, j, i - j] = v
        for i in range(d):
            for c in range(i):
                x = L[i, c]
                for q in range(p):
                    W[k, i, q] -= x * W[k, c, q]
            x = inverse[i]
            for q in range(p):
                W[k, i, q] *= x
    return 0
