# SPDX-License-Identifier: BSD-3-Clause
"""Cholesky factorisation of a block tridiagonal chain, a border solved along, in one pass over the ticks.

    A(k) = D(k) - X(k-1) X(k-1)',   L(k) L(k)' = A(k),   X(k) = E(k) L(k)^-T
    W(k) = L(k)^-1 (B(k) - X(k-1) W(k-1)),   S = W' W

The columns of the border are the innermost loop: it runs over neighbours in memory. What a tick needs of the one
before is still in the cache, unlike with one LAPACK call after the other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def factorise(D: Array, E: Array, scale: Array, start: int, columns: Array, W: Array) -> int:
    """Factorises a chain, or goes on with it, and solves for the border in place.

    Args:
        D: diagonal blocks of some ticks, of which the lower triangle is read, shape (s, d, d).
        E: blocks below the diagonal, the first one before the first of these ticks if there is a tick before; (s, d, d)
            or, from the first tick on, (s - 1, d, d).
        scale: factor on the diagonal of each tick, shape (s,).
        start: tick of the first of them.
        columns: takes L, the lower band column by column, zeros before, all ticks, shape (m, d, 2d).
        W: the border of all ticks, which becomes L^-1 times it where they are, shape (m, d, p).

    Returns:
        0, or one more than the index of the first pivot that is not positive.
    """
    _, d, p = W.shape
    A, L, X, inverse = np.empty((d, d)), np.zeros((d, d)), np.zeros((d, d)), np.empty(d)
    if start > 0:
        for j in range(d):
            for i in range(j, d):
                L[i, j] = columns[start - 1, j, i - j]
            inverse[j] = 1.0 / L[j, j]
    first = 0 if start > 0 else 1
    for s in range(len(D)):
        k = start + s
        if k > 0:
            _solve_below(E[s - first], L, inverse, X, columns[k - 1])
            _subtract(X, W[k - 1], W[k], p)
        pivot = _factor(D[s], scale[s], X, A, L, inverse, columns[k])
        if pivot > 0:
            return k * d + pivot
        _solve(L, inverse, W[k], p)
    return 0


@compiled
def condense(
    D: Array, E: Array, B: Array, g: Array, kept: NDArray[np.intp], scale: Array, columns: Array, S: Array
) -> int:
    """Factorises the inner states of a chain; only the square of the border that they see is kept.

    Args:
        D: diagonal blocks of all states, both ends included, shape (m + 2, d, d).
        E: blocks below the diagonal, shape (m + 1, d, d).
        B: border, shape (m + 2, d, p).
        g: gradient, shape (m + 2, d).
        kept: columns of the border that are wanted, shape (q,).
        scale: factor on the diagonal of each state, shape (m + 2,).
        columns: takes L of the inner states, see `factorise`, shape (m, d, 2d).
        S: takes the lower triangle of W' W for the columns gradient, kept, first state, last state; shape (n, n).

    Returns:
        0, or one more than the index of the first pivot that is not positive.
    """
    m, d, _ = columns.shape
    q = len(kept)
    p, n = 1 + q + d, 1 + q + 2 * d
    A, L, X, inverse = np.empty((d, d)), np.zeros((d, d)), np.zeros((d, d)), np.empty(d)
    before, W = np.zeros((d, n)), np.zeros((d, n))
    S[:] = 0.0
    for k in range(m):
        before, W = W, before
        for i in range(d):
            W[i, 0] = g[k + 1, i]
            for c in range(q):
                W[i, 1 + c] = B[k + 1, i, kept[c]]
            for c in range(d):
                W[i, 1 + q + c] = E[0, i, c] if k == 0 else 0.0
        if k > 0:
            _solve_below(E[k], L, inverse, X, columns[k - 1])
            _subtract(X, before, W, p)
        pivot = _factor(D[k + 1], scale[k + 1], X, A, L, inverse, columns[k])
        if pivot > 0:
            return k * d + pivot
        if k == m - 1:  # the last state is seen from the one before it alone
            for i in range(d):
                for c in range(d):
                    W[i, p + c] = E[m, c, i]
            p = n
        _solve(L, inverse, W, p)
        _add_square(W, p, S)
    return 0


@compiled
def solve_back(columns: Array, right: Array) -> None:
    """L^-T times a matrix, in place.

    Args:
        columns: L as `factorise` leaves it, shape (m, d, 2d).
        right: shape (m d, c).
    """
    m, d, width = columns.shape
    n, count = right.shape
    for k in range(m - 1, -1, -1):
        for j in range(d - 1, -1, -1):
            row = k * d + j
            for a in range(1, min(width, n - row)):
                x = columns[k, j, a]
                if x != 0.0:
                    for c in range(count):
                        right[row, c] -= x * right[row + a, c]
            x = 1.0 / columns[k, j, 0]
            for c in range(count):
                right[row, c] *= x


@compiled
def solve_forth(columns: Array, right: Array) -> None:
    """L^-1 times a vector, in place; arguments as in `solve_back`, right of shape (m d,)."""
    m, d, width = columns.shape
    n = len(right)
    for k in range(m):
        for j in range(d):
            row = k * d + j
            x = right[row] / columns[k, j, 0]
            right[row] = x
            for a in range(1, min(width, n - row)):
                right[row + a] -= x * columns[k, j, a]


@compiled
def _solve_below(E: Array, L: Array, inverse: Array, X: Array, columns: Array) -> None:
    """X = E L^-T, kept in the columns of the tick before."""
    d = len(L)
    for i in range(d):
        for j in range(d):
            v = E[i, j]
            for c in range(j):
                v -= X[i, c] * L[j, c]
            v *= inverse[j]
            X[i, j] = v
            columns[j, d - j + i] = v


@compiled
def _factor(D: Array, scale: float, X: Array, A: Array, L: Array, inverse: Array, columns: Array) -> int:
    """L of D - X X'; 0, or one more than the component of a pivot that is not positive."""
    d = len(L)
    for i in range(d):
        for j in range(i + 1):
            v = D[i, j] * scale if i == j else D[i, j]
            for c in range(d):
                v -= X[i, c] * X[j, c]
            A[i, j] = v
    for j in range(d):
        v = A[j, j]
        for c in range(j):
            v -= L[j, c] * L[j, c]
        if v <= 0.0:
            return j + 1
        root = np.sqrt(v)
        L[j, j] = root
        inverse[j] = 1.0 / root
        columns[j, 0] = root
        for i in range(j + 1, d):
            v = A[i, j]
            for c in range(j):
                v -= L[i, c] * L[j, c]
            v *= inverse[j]
            L[i, j] = v
            columns[j, i - j] = v
    return 0


@compiled
def _subtract(X: Array, before: Array, W: Array, p: int) -> None:
    """W - X W of the tick before; four rows at once, so that W is read and written less often."""
    d = len(X)
    whole = d - d % 4
    for i in range(d):
        for c in range(0, whole, 4):
            x0, x1, x2, x3 = X[i, c], X[i, c + 1], X[i, c + 2], X[i, c + 3]
            for q in range(p):
                W[i, q] -= x0 * before[c, q] + x1 * before[c + 1, q] + x2 * before[c + 2, q] + x3 * before[c + 3, q]
        for c in range(whole, d):
            x0 = X[i, c]
            for q in range(p):
                W[i, q] -= x0 * before[c, q]


@compiled
def _solve(L: Array, inverse: Array, W: Array, p: int) -> None:
    """L^-1 W."""
    for i in range(len(L)):
        for c in range(i):
            x = L[i, c]
            for q in range(p):
                W[i, q] -= x * W[c, q]
        x = inverse[i]
        for q in range(p):
            W[i, q] *= x


@compiled
def _add_square(W: Array, p: int, S: Array) -> None:
    """Adds the lower triangle of W' W, four rows at once."""
    d = len(W)
    whole = d - d % 4
    for a in range(p):
        for i in range(0, whole, 4):
            x0, x1, x2, x3 = W[i, a], W[i + 1, a], W[i + 2, a], W[i + 3, a]
            for c in range(a + 1):
                S[a, c] += x0 * W[i, c] + x1 * W[i + 1, c] + x2 * W[i + 2, c] + x3 * W[i + 3, c]
        for i in range(whole, d):
            x0 = W[i, a]
            for c in range(a + 1):
                S[a, c] += x0 * W[i, c]
