# SPDX-License-Identifier: BSD-3-Clause
"""The squares of one factor's rows added where they belong, sample by sample, without arrays between.

With the whitened row z = [r | P | J0 | J1] of a sample, residual and derivatives by shared values and by the states it
touches, the lower triangle of z' z holds all that a sample adds to Hessian and gradient.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]
Places = NDArray[np.intp]


@compiled
def add_squares(
    weights: Array,
    r: Array,
    P: Array,
    J0: Array,
    J1: Array,
    ticks: Places,
    places: Places,
    D: Array,
    E: Array,
    B: Array,
    C: Array,
    g_x: Array,
    g_p: Array,
    costs: Array,
    D_next: Array,
    g_next: Array,
) -> float:
    """Adds the samples of a factor to normal equations, in their order.

    Args:
        weights: of the rows, one over their sigmas, shape (m, k).
        r: residual, shape (m, k).
        P: derivative by shared values, shape (m, k, q).
        J0: derivative by the first state of each sample, shape (m, k, d), or (0, k, d) where it touches none.
        J1: the same by the state after that, or of length 0.
        ticks: first state of each sample, shape (m,); one may come several times.
        places: columns of the q shared values.
        D: diagonal blocks, shape (n, d, d).
        E: blocks below them, shape (n - 1, d, d).
        B: border, shape (n, d, p).
        C: corner, shape (p, p).
        g_x: gradient by the states, shape (n, d).
        g_p: gradient by the shared values, shape (p,).
        costs: receives half the sum of squares of each tick; left alone where no state is touched.
        D_next: receives the part of J0 once more where J1 is there; of length 0 where it is not wanted.
        g_next: the same of the gradient.

    Returns:
        Half the sum of squares.
    """
    m, rows, q = P.shape
    d, first, second = J0.shape[2], len(J0) > 0, len(J1) > 0
    a, b = 1 + q, 1 + q + d
    size = a + d * (int(first) + int(second))
    # four rows at once, so that H is read and written less often; rows of zeros fill up the last four
    z, H, total = np.zeros((rows + (-rows) % 4, size)), np.empty((size, size)), 0.0
    for k in range(m):
        for row in range(rows):
            w = weights[k, row]
            z[row, 0] = w * r[k, row]
            for c in range(q):
                z[row, 1 + c] = w * P[k, row, c]
            if first:
                for c in range(d):
                    z[row, a + c] = w * J0[k, row, c]
            if second:
                for c in range(d):
                    z[row, b + c] = w * J1[k, row, c]
        for i in range(size):
            for j in range(i + 1):
                H[i, j] = 0.0
            for row in range(0, rows, 4):
                x0, x1, x2, x3 = z[row, i], z[row + 1, i], z[row + 2, i], z[row + 3, i]
                if x0 != 0.0 or x1 != 0.0 or x2 != 0.0 or x3 != 0.0:  # most derivatives of a measurement are zero
                    for j in range(i + 1):
                        H[i, j] += x0 * z[row, j] + x1 * z[row + 1, j] + x2 * z[row + 2, j] + x3 * z[row + 3, j]
        total += 0.5 * H[0, 0]
        for i in range(q):
            g_p[places[i]] += H[1 + i, 0]
            for j in range(i):
                C[places[i], places[j]] += H[1 + i, 1 + j]
                C[places[j], places[i]] += H[1 + i, 1 + j]
            C[places[i], places[i]] += H[1 + i, 1 + i]
        if not first:
            continue
        t = ticks[k]
        costs[t] += 0.5 * H[0, 0]
        _add_state(H, a, places, D[t], B[t], g_x[t])
        if second:
            _add_state(H, b, places, D[t + 1], B[t + 1], g_x[t + 1])
            for i in range(d):
                for j in range(d):
                    E[t, i, j] += H[b + i, a + j]
            if len(D_next) > 0:
                _add_state(H, a, places[:0], D_next[t], B[t], g_next[t])
    return total


@compiled
def _add_state(H: Array, at: int, places: Places, D: Array, B: Array, g: Array) -> None:
    """Adds what the rows of H from `at` on say of one state."""
    for i in range(len(g)):
        if H[at + i, at + i] == 0.0:  # the rows see nothing of this component
            continue
        g[i] += H[at + i, 0]
        for c in range(len(places)):
            B[i, places[c]] += H[at + i, 1 + c]
        for j in range(i):
            D[i, j] += H[at + i, at + j]
            D[j, i] += H[at + i, at + j]
        D[i, i] += H[at + i, at + i]
