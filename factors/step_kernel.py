# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of the Hermite-Simpson step, and the weights of any step, as loops over steps.

With A0, A_mid, A1 the derivatives of the accelerations by their states, by rows of rates v and positions q:

    da_mid/dx0 = A_mid (1/2 + h/8 (rows q: d/dv)) + h/8 A_mid[:, rates] A0,   likewise by x1 with signs turned
    d_v = x1 - x0 - h/6 (a0 + 4 a_mid + a1),   d_q = q1 - q0 - h/2 (v0 + v1) - h^2/12 (a0 - a1)

simpson_dynamics.py and step.py have the equations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]
Columns = NDArray[np.intp]


@compiled
def step_derivatives(
    h: Array,
    positions: Columns,
    rates: Columns,
    A0: Array,
    A_mid: Array,
    A1: Array,
    P0: Array,
    P_mid: Array,
    P1: Array,
    v_by_x0: Array,
    q_by_x0: Array,
    v_by_x1: Array,
    q_by_x1: Array,
    v_by_p: Array,
    q_by_p: Array,
) -> None:
    """Derivatives of the defects of rates and positions over m steps.

    Args:
        h: lengths of the steps, shape (m,) [s].
        positions: columns of the k positions in a state.
        rates: columns of their velocities, then of memories, r in all.
        A0: derivative of the accelerations by the state at the beginning, shape (m, r, d).
        A_mid: by that in the middle.
        A1: by that at the end.
        P0: derivative of the accelerations at the beginning by the parameters, shape (m, r, p).
        P_mid: of those in the middle.
        P1: of those at the end.
        v_by_x0: receives the derivative of the rates' defects by the first state, shape (m, r, d).
        q_by_x0: of the positions' defects, shape (m, k, d).
        v_by_x1: by the second state.
        q_by_x1: by the second state.
        v_by_p: by the parameters, shape (m, r, p).
        q_by_p: by the parameters, shape (m, k, p).
    """
    m, r, d = A0.shape
    k, p = len(positions), P0.shape[2]
    for step in range(m):
        length = h[step]
        eighth, sixth, twelfth = length / 8.0, length / 6.0, length * length / 12.0
        for i in range(r):
            by_0, by_1, by_p = v_by_x0[step, i], v_by_x1[step, i], v_by_p[step, i]
            for c in range(d):
                by_0[c] = 0.5 * A_mid[step, i, c]
                by_1[c] = by_0[c]
            for c in range(p):
                by_p[c] = P_mid[step, i, c]
            for c in range(k):
                x = eighth * A_mid[step, i, positions[c]]
                by_0[rates[c]] += x
                by_1[rates[c]] -= x
            for j in range(r):
                x = eighth * A_mid[step, i, rates[j]]
                if x != 0.0:
                    for c in range(d):
                        by_0[c] += x * A0[step, j, c]
                        by_1[c] -= x * A1[step, j, c]
                    for c in range(p):
                        by_p[c] += x * (P0[step, j, c] - P1[step, j, c])
            for c in range(d):
                by_0[c] = -sixth * (A0[step, i, c] + 4.0 * by_0[c])
                by_1[c] = -sixth * (A1[step, i, c] + 4.0 * by_1[c])
            for c in range(p):
                by_p[c] = -sixth * (P0[step, i, c] + 4.0 * by_p[c] + P1[step, i, c])
            by_0[rates[i]] -= 1.0
            by_1[rates[i]] += 1.0
        for i in range(k):
            for c in range(d):
                q_by_x0[step, i, c] = -twelfth * A0[step, i, c]
                q_by_x1[step, i, c] = twelfth * A1[step, i, c]
            for c in range(p):
                q_by_p[step, i, c] = -twelfth * (P0[step, i, c] - P1[step, i, c])
            q_by_x0[step, i, positions[i]] -= 1.0
            q_by_x1[step, i, positions[i]] += 1.0
            q_by_x0[step, i, rates[i]] -= 0.5 * length
            q_by_x1[step, i, rates[i]] -= 0.5 * length


@compiled
def combine(weight: Array, lag: Array, d_v: Array, d_q: Array, combined: Array) -> None:
    """Rows whose noise is independent: W d_v, then W (d_q - lag d_v).

    Args:
        weight: W of the link rows of each step, shape (m, n, n); n = 0 for the identity.
        lag: by which positions are behind in each step, shape (m,) [s].
        d_v: defects of rates, or derivatives of them, shape (m, r, c).
        d_q: the same of positions, shape (m, k, c).
        combined: receives the rows, shape (m, r + k, c).
    """
    m, r, columns = d_v.shape
    k, n = d_q.shape[1], weight.shape[1]
    for step in range(m):
        for i in range(r):
            for c in range(columns):
                combined[step, i, c] = d_v[step, i, c] if i >= n else 0.0
        for i in range(k):
            for c in range(columns):
                x = d_q[step, i, c] - lag[step] * d_v[step, i, c]
                combined[step, r + i, c] = x if i >= n else 0.0
        for i in range(n):
            for j in range(n):
                w = weight[step, i, j]
                for c in range(columns):
                    combined[step, i, c] += w * d_v[step, j, c]
                    combined[step, r + i, c] += w * (d_q[step, j, c] - lag[step] * d_v[step, j, c])
