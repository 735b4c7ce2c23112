# SPDX-License-Identifier: BSD-3-Clause
"""Blocks of the inverse of a chain, and what they make of residuals; equations in posterior.py."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def selected_inverse(columns: Array, P: Array, neighbours: Array) -> None:
    """Backward recursion over a factorised chain.

    Args:
        columns: L as `band_kernel.factorise` leaves it, shape (m, d, 2d).
        P: receives the blocks on the diagonal, shape (m, d, d).
        neighbours: receives those of X(k) with X(k+1), shape (m - 1, d, d).
    """
    m, d, _ = columns.shape
    inverse, C, across = np.zeros((d, d)), np.empty((d, d)), np.empty((d, d))
    for k in range(m - 1, -1, -1):
        for c in range(d):
            inverse[c, c] = 1.0 / columns[k, c, 0]
            for i in range(c + 1, d):
                x = 0.0
                for j in range(c, i):
                    x -= columns[k, j, i - j] * inverse[j, c]
                inverse[i, c] = x / columns[k, i, 0]
        for a in range(d):
            for b in range(d):
                x = 0.0
                for i in range(max(a, b), d):
                    x += inverse[i, a] * inverse[i, b]
                P[k, a, b] = x
        if k == m - 1:
            continue
        C[:], across[:] = 0.0, 0.0
        for i in range(d):
            for j in range(d):
                x = columns[k, j, d - j + i]
                for c in range(j + 1):
                    C[i, c] += x * inverse[j, c]
        for i in range(d):
            for a in range(d):
                x = C[i, a]
                for b in range(d):
                    across[a, b] += x * P[k + 1, i, b]
        for a in range(d):
            for i in range(d):
                x = across[a, i]
                neighbours[k, a, i] = -x
                for b in range(d):
                    P[k, a, b] += x * C[i, b]


@compiled
def absorb(
    J0: Array,
    J1: Array,
    ticks: NDArray[np.intp],
    given: Array,
    neighbours: Array,
    response: Array,
    shared: Array,
    by_shared: Array,
    leverage: Array,
) -> None:
    """Leverage of whitened rows, and their derivatives by shared values with the states following along.

    Args:
        J0: derivative by the first state of each sample, shape (s, r, d); of length 0 where none is touched.
        J1: by the state after that, or of length 0.
        ticks: first state of each sample, shape (s,).
        given: covariance of each state for known shared values, shape (m, d, d).
        neighbours: of each state with the next, shape (m - 1, d, d).
        response: change of each state against the shared values, shape (m, d, p).
        shared: covariance of the shared values, shape (p, p).
        by_shared: derivative by the shared values, changed in place, shape (s, r, p).
        leverage: receives the share of each row's variance that the fit absorbs, shape (s, r).
    """
    samples, rows, p = by_shared.shape
    d = J0.shape[2]
    for k in range(samples):
        for row in range(rows):
            found, values = 0.0, by_shared[k, row]
            for side in range(2):
                J = J0 if side == 0 else J1
                if len(J) == 0:
                    continue
                t, own = ticks[k] + side, J[k, row]
                for i in range(d):
                    if own[i] != 0.0:
                        x = 0.0
                        for j in range(d):
                            x += given[t, i, j] * own[j]
                        found += own[i] * x
                        for c in range(p):
                            values[c] -= own[i] * response[t, i, c]
            if len(J1) > 0:
                for i in range(d):
                    if J0[k, row, i] != 0.0:
                        x = 0.0
                        for j in range(d):
                            x += neighbours[ticks[k], i, j] * J1[k, row, j]
                        found += 2.0 * J0[k, row, i] * x
            for i in range(p):
                x = 0.0
                for j in range(p):
                    x += shared[i, j] * values[j]
                found += values[i] * x
            leverage[k, row] = found
