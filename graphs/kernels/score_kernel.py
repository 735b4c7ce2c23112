# SPDX-License-Identifier: BSD-3-Clause
"""Columns of hypotheses beside a factorised chain: their border, and what is left of it after the states are gone.

The columns are the innermost loop, and what a tick needs of the one before is still in the cache.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]
Columns = NDArray[np.intp]


@compiled
def simpson_columns(
    h: Array, first: Array, last: Array, middle: Array, by_rates: Array, d_v: Array, d_q: Array
) -> None:
    """What accelerations add to the defects of Simpson's rule, whose middle moves along.

    Args:
        h: lengths of the steps, shape (m,) [s].
        first: accelerations where each step begins, shape (m, r, k).
        last: the same where it ends.
        middle: the same between.
        by_rates: derivative of all accelerations by the rates in the middle, shape (m, r, r).
        d_v: receives the part of the rates, shape (m, r, k).
        d_q: receives that of the positions, shape (m, n, k).
    """
    m, r, k = first.shape
    n = d_q.shape[1]
    for step in range(m):
        eighth, sixth, twelfth = h[step] / 8.0, h[step] / 6.0, h[step] * h[step] / 12.0
        for i in range(r):
            for c in range(k):
                d_v[step, i, c] = first[step, i, c] + 4.0 * middle[step, i, c] + last[step, i, c]
            for j in range(r):
                x = 4.0 * eighth * by_rates[step, i, j]
                if x != 0.0:
                    for c in range(k):
                        d_v[step, i, c] += x * (first[step, j, c] - last[step, j, c])
            for c in range(k):
                d_v[step, i, c] *= -sixth
        for i in range(n):
            for c in range(k):
                d_q[step, i, c] = -twelfth * (first[step, i, c] - last[step, i, c])


@compiled
def add_border(J: Array, Z: Array, ticks: Columns, B: Array) -> None:
    """Adds J' Z of every sample to the border of its state.

    Args:
        J: derivative of rows by the state, shape (s, r, d).
        Z: the same rows by k columns, with both weights in it, shape (s, r, k).
        ticks: state of each sample, shape (s,); one may come several times.
        B: border, shape (m, d, k).
    """
    samples, rows, d = J.shape
    k, whole = Z.shape[2], rows - rows % 4
    for s in range(samples):
        t = ticks[s]
        for row in range(0, whole, 4):
            for i in range(d):
                x0, x1, x2, x3 = J[s, row, i], J[s, row + 1, i], J[s, row + 2, i], J[s, row + 3, i]
                if x0 != 0.0 or x1 != 0.0 or x2 != 0.0 or x3 != 0.0:
                    for c in range(k):
                        B[t, i, c] += (
                            x0 * Z[s, row, c] + x1 * Z[s, row + 1, c] + x2 * Z[s, row + 2, c] + x3 * Z[s, row + 3, c]
                        )
        for row in range(whole, rows):
            for i in range(d):
                x0 = J[s, row, i]
                if x0 != 0.0:
                    for c in range(k):
                        B[t, i, c] += x0 * Z[s, row, c]


@compiled
def solve_forth_columns(columns: Array, start: int, before: Array, B: Array) -> None:
    """L^-1 times a border in place, tick after tick.

    Args:
        columns: L as `band_kernel.factorise` leaves it, shape (m, d, 2d).
        start: tick of the first row of B.
        before: L^-1 times the border of the tick before that, shape (d, k); not looked at where it is the first.
        B: shape (s, d, k).
    """
    count, d, k = B.shape
    whole = d - d % 4
    for s in range(count):
        t, W = start + s, B[s]
        if t > 0:
            X, V = columns[t - 1], before if s == 0 else B[s - 1]  # X(i, c) stands d - c + i behind the diagonal
            for i in range(d):
                for c in range(0, whole, 4):
                    x0, x1, x2, x3 = (
                        X[c, d - c + i],
                        X[c + 1, d - c - 1 + i],
                        X[c + 2, d - c - 2 + i],
                        X[c + 3, d - c - 3 + i],
                    )
                    for q in range(k):
                        W[i, q] -= x0 * V[c, q] + x1 * V[c + 1, q] + x2 * V[c + 2, q] + x3 * V[c + 3, q]
                for c in range(whole, d):
                    x0 = X[c, d - c + i]
                    for q in range(k):
                        W[i, q] -= x0 * V[c, q]
        L = columns[t]
        for i in range(d):
            for c in range(i):
                x0 = L[c, i - c]
                for q in range(k):
                    W[i, q] -= x0 * W[c, q]
            x0 = 1.0 / L[i, 0]
            for q in range(k):
                W[i, q] *= x0
