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
    # four rows and two columns at once, so that H is read and written less often; zeros fill up the last ones
    z = np.zeros((rows + (-rows) % 4, size + size % 2))
    H, shared, total = np.zeros((z.shape[1], z.shape[1])), np.zeros((a, a)), 0.0
    side_by_side = q > 0
    for c in range(1, q):
        side_by_side = side_by_side and places[c] == places[0] + c
    start = places[0] if side_by_side else -1
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
        _square(z, H)
        total += 0.5 * H[0, 0]
        for i in range(a):
            for j in range(i + 1):
                shared[i, j] += H[i, j]
        if not first:
            continue
        t = ticks[k]
        costs[t] += 0.5 * H[0, 0]
        _add_state(H, a, places, start, D[t], B[t], g_x[t])
        if second:
            _add_state(H, b, places, start, D[t + 1], B[t + 1], g_x[t + 1])
            for i in range(d):
                for j in range(d):
                    E[t, i, j] += H[b + i, a + j]
            if len(D_next) > 0:
                _add_state(H, a, places[:0], -1, D_next[t], B[t], g_next[t])
    for i in range(q):
        g_p[places[i]] += shared[1 + i, 0]
        for j in range(i):
            C[places[i], places[j]] += shared[1 + i, 1 + j]
            C[places[j], places[i]] += shared[1 + i, 1 + j]
        C[places[i], places[i]] += shared[1 + i, 1 + i]
    return total


@compiled
def _square(z: Array, H: Array) -> None:
    """The lower triangle of z' z, and a little more."""
    rows, size = z.shape
    for i in range(0, size, 2):
        for j in range(i + 2):
            H[i, j] = 0.0
            H[i + 1, j] = 0.0
        for row in range(0, rows, 4):
            x0, x1, x2, x3 = z[row, i], z[row + 1, i], z[row + 2, i], z[row + 3, i]
            y0, y1, y2, y3 = z[row, i + 1], z[row + 1, i + 1], z[row + 2, i + 1], z[row + 3, i + 1]
            x, y = x0 != 0.0 or x1 != 0.0 or x2 != 0.0 or x3 != 0.0, y0 != 0.0 or y1 != 0.0 or y2 != 0.0 or y3 != 0.0
            if x or y:  # most derivatives of a measurement are zero
                for j in range(i + 2):
                    z0, z1, z2, z3 = z[row, j], z[row + 1, j], z[row + 2, j], z[row + 3, j]
                    H[i, j] += x0 * z0 + x1 * z1 + x2 * z2 + x3 * z3
                    H[i + 1, j] += y0 * z0 + y1 * z1 + y2 * z2 + y3 * z3


@compiled
def _add_state(H: Array, at: int, places: Places, start: int, D: Array, B: Array, g: Array) -> None:
    """Adds what the rows of H from `at` on say of one state; `start` is -1 or where all places begin."""
    for i in range(len(g)):
        if H[at + i, at + i] == 0.0:  # the rows see nothing of this component
            continue
        g[i] += H[at + i, 0]
        if start >= 0:
            for c in range(len(places)):
                B[i, start + c] += H[at + i, 1 + c]
        else:
            for c in range(len(places)):
                B[i, places[c]] += H[at + i, 1 + c]
        for j in range(i):
            D[i, j] += H[at + i, at + j]
            D[j, i] += H[at + i, at + j]
        D[i, i] += H[at + i, at + i]
