# SPDX-License-Identifier: BSD-3-Clause
"""Accelerations of a tree of rigid bodies and their derivatives by recursions over the joints, sample by sample.

All vectors are in the axes of the base and about its origin. A motion is (linear, angular), S that of a joint at unit
velocity. Of a body, and of all bodies behind a joint: mass m, h = m c, second moments Sigma = int r r' dm, force
f = I a + v x* I v, linear momentum p, and Gamma = -[omega] Sigma - [h] [v]. They add up over bodies, and

    2 B x = v x* I x + x x* I v - I (v x x) = 2 (x_angular x p, Gamma x_angular)

    psi = v_parent x S,    chi = a_parent x S + v_parent x psi
    dtau_i/dq_j = S_i . (2 B_j psi_j + I_j chi_j + S_j x* f_j),    dtau_j/dq_i = S_j . (2 B_j psi_i + I_j chi_i)
    dtau_i/dv_j = 2 S_i . (B_j S_j + I_j psi_j),                   dtau_j/dv_i = 2 S_j . (B_j S_i + I_j psi_i)

for i on the way from the base to j. Then da/dq = -M^-1 dtau/dq, likewise by v. Reference: Singh, Russell, Wensing
(2022), "Efficient analytical derivatives of rigid-body dynamics using spatial vector algebra".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.joint_recursion import (
    AT_A,
    AT_CHI,
    AT_F,
    AT_GAMMA,
    AT_M,
    AT_OWN,
    AT_P,
    AT_PSI,
    AT_S,
    AT_V,
    COLUMNS,
    add_product,
    cross,
    dot,
    place,
    plus,
    push,
    put,
    times_inertia,
    turned,
    vector,
    weigh,
)
from jointscope.robots.bodies.joint_table import ARMATURE
from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def _sum_up(parents, first, W):  # type: ignore[no-untyped-def]
    """Sums of the columns from `first` on over all bodies behind each joint."""
    for j in range(len(parents) - 1, -1, -1):
        if parents[j] >= 0:
            for k in range(first, AT_OWN):
                W[parents[j], k] += W[j, k]


@compiled
def _invert(M, inverse):  # type: ignore[no-untyped-def]
    """M^-1 of a symmetric positive definite matrix; leaves its Cholesky factor in M."""
    n = len(M)
    for j in range(n):
        for i in range(j, n):
            x = M[i, j]
            for k in range(j):
                x -= M[i, k] * M[j, k]
            M[i, j] = np.sqrt(x) if i == j else x / M[j, j]
    for c in range(n):
        for i in range(n):
            x = 1.0 if i == c else 0.0
            for k in range(c, i):
                x -= M[i, k] * inverse[k, c]
            inverse[i, c] = x / M[i, i] if i >= c else 0.0
        for i in range(n - 1, -1, -1):
            x = inverse[i, c]
            for k in range(i + 1, n):
                x -= M[k, i] * inverse[k, c]
            inverse[i, c] = x / M[i, i]


@compiled
def _solve(parents, table, tau, W, M, inverse, a):  # type: ignore[no-untyped-def]
    """M^-1, and the accelerations where the work space holds the forces without any."""
    n = len(parents)
    for j in range(n):
        for i in range(n):
            M[i, j] = 0.0
    for j in range(n):
        force, moment = times_inertia(W, j, AT_M, vector(W, j, AT_S), vector(W, j, AT_S + 3))
        i = j
        while i >= 0:
            M[j, i] = dot(vector(W, i, AT_S), force) + dot(vector(W, i, AT_S + 3), moment)
            i = parents[i]
        M[j, j] += table[j, ARMATURE]
        a[j] = 0.0
    _invert(M, inverse)
    for j in range(n):
        x = tau[j] - dot(vector(W, j, AT_S), vector(W, j, AT_F)) - dot(vector(W, j, AT_S + 3), vector(W, j, AT_F + 3))
        for i in range(n):
            a[i] += inverse[i, j] * x


@compiled
def _add_torque_derivatives(j, parents, gravity, W, by_q, by_v):  # type: ignore[no-untyped-def]
    """Derivatives of the torques of the motion in the work space: row j and column j, as far as joints before it go."""
    y, w, about, p, f = (
        vector(W, j, AT_S),
        vector(W, j, AT_S + 3),
        vector(W, j, AT_PSI + 3),
        vector(W, j, AT_P),
        vector(W, j, AT_F),
    )
    i = parents[j]
    if i < 0:
        put(W, j, AT_CHI, cross(w, (gravity[0], gravity[1], gravity[2])))
        put(W, j, AT_CHI + 3, (0.0, 0.0, 0.0))
    else:
        for k in range(6):
            W[j, AT_CHI + k] = 0.0
        add_product(W, i, AT_A, j, AT_S, AT_CHI)
        add_product(W, i, AT_V, j, AT_PSI, AT_CHI)
    a, b = times_inertia(W, j, AT_M, vector(W, j, AT_CHI), vector(W, j, AT_CHI + 3))
    c, d = cross(about, p), turned(W, j, AT_GAMMA, about)
    a = plus(plus(a, plus(c, c)), cross(w, f))
    b = plus(plus(b, plus(d, d)), plus(cross(w, vector(W, j, AT_F + 3)), cross(y, f)))
    c, d = times_inertia(W, j, AT_M, vector(W, j, AT_PSI), about)
    c, d = plus(c, cross(w, p)), plus(d, turned(W, j, AT_GAMMA, w))
    force, moment = times_inertia(W, j, AT_M, y, w)
    # B_j' S_j has an angular part alone
    g0, g1, g2, e = vector(W, j, AT_GAMMA), vector(W, j, AT_GAMMA + 3), vector(W, j, AT_GAMMA + 6), cross(p, y)
    back = (
        e[0] + g0[0] * w[0] + g1[0] * w[1] + g2[0] * w[2],
        e[1] + g0[1] * w[0] + g1[1] * w[1] + g2[1] * w[2],
        e[2] + g0[2] * w[0] + g1[2] * w[1] + g2[2] * w[2],
    )
    i = j
    while i >= 0:
        y, w, about = vector(W, i, AT_S), vector(W, i, AT_S + 3), vector(W, i, AT_PSI + 3)
        by_q[j, i] = 2.0 * dot(back, about) + dot(force, vector(W, i, AT_CHI)) + dot(moment, vector(W, i, AT_CHI + 3))
        by_v[j, i] = 2.0 * (dot(back, w) + dot(force, vector(W, i, AT_PSI)) + dot(moment, about))
        by_q[i, j] = dot(y, a) + dot(w, b)
        by_v[i, j] = 2.0 * (dot(y, c) + dot(w, d))
        i = parents[i]


@compiled
def accelerations(
    parents: NDArray[np.intp],
    table: Array,
    gravity: Array,
    q: Array,
    v: Array,
    tau: Array,
    a: Array,
    by_q: Array,
    by_v: Array,
    M_inverse: Array,
) -> None:
    """Accelerations of samples, and their derivatives where there is room for them.

    Args:
        parents: joint before each, -1 for the base, shape (n,).
        table: rows of a `JointTable`, shape (n, 27).
        gravity: acceleration in the base frame, shape (3,) [m/s^2].
        q: positions, shape (m, n) [rad] or [m].
        v: velocities, shape (m, n).
        tau: torques, shape (m, n) [N m] or [N].
        a: receives the accelerations, shape (m, n).
        by_q: receives their derivatives by q, shape (m, n, n); of length 0 where they are not wanted.
        by_v: the same by v.
        M_inverse: the same by tau.
    """
    m, n = q.shape
    W, M, inverse = np.empty((n, COLUMNS)), np.empty((n, n)), np.empty((n, n))
    tau_q, tau_v = np.zeros((n, n)), np.zeros((n, n))
    for k in range(m):
        for i in range(n):
            place(i, parents[i], q[k, i], v[k, i], table, W)
            weigh(i, table, W)
            push(i, parents[i], v[k, i], 0.0, gravity, W)
        _sum_up(parents, AT_M, W)
        _solve(parents, table, tau[k], W, M, inverse, a[k])
        if len(by_q) == 0:
            continue
        for i in range(n):
            push(i, parents[i], v[k, i], a[k, i], gravity, W)
        _sum_up(parents, AT_F, W)
        for j in range(n):
            _add_torque_derivatives(j, parents, gravity, W, tau_q, tau_v)
        for i in range(n):
            for j in range(n):
                x, y = 0.0, 0.0
                for c in range(n):
                    x -= inverse[i, c] * tau_q[c, j]
                    y -= inverse[i, c] * tau_v[c, j]
                by_q[k, i, j], by_v[k, i, j], M_inverse[k, i, j] = x, y, inverse[i, j]
