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

from jointscope.robots.bodies.joint_table import ARMATURE, FIRST, MASS, ORIGIN, SECOND, TURNS
from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]

# columns of the work space, a row for each joint: pose and motions; sums over all bodies behind it; the body's own
_R, _O, _S, _V, _A, _PSI, _CHI, _ALL = np.cumsum((0, 9, 3, 6, 6, 6, 6, 6))
_M, _H, _SIGMA, _P, _GAMMA, _F, _OWN, _WORK = _ALL + np.cumsum((0, 1, 3, 9, 3, 9, 6, 13))


@compiled
def _cross(a, b):  # type: ignore[no-untyped-def]
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def _plus(a, b):  # type: ignore[no-untyped-def]
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _at(W, i, k):  # type: ignore[no-untyped-def]
    return W[i, k], W[i, k + 1], W[i, k + 2]


@compiled
def _put(W, i, k, a):  # type: ignore[no-untyped-def]
    W[i, k], W[i, k + 1], W[i, k + 2] = a


@compiled
def _turned(W, i, k, x):  # type: ignore[no-untyped-def]
    return _dot(_at(W, i, k), x), _dot(_at(W, i, k + 3), x), _dot(_at(W, i, k + 6), x)


@compiled
def _times_inertia(W, i, k, y, w):  # type: ignore[no-untyped-def]
    """(m y + w x h, h x y + (tr Sigma - Sigma) w) where m, h and Sigma begin in column k."""
    m, h, trace = W[i, k], _at(W, i, k + 1), W[i, k + 4] + W[i, k + 8] + W[i, k + 12]
    a, b, c = _cross(w, h), _cross(h, y), _turned(W, i, k + 4, w)
    return (
        (m * y[0] + a[0], m * y[1] + a[1], m * y[2] + a[2]),
        (b[0] + trace * w[0] - c[0], b[1] + trace * w[1] - c[1], b[2] + trace * w[2] - c[2]),
    )


@compiled
def _add_product(W, i, k, j, at, to):  # type: ignore[no-untyped-def]
    """Adds motion k of joint i times motion `at` of joint j to motion `to` of joint j."""
    y, w, z, u = _at(W, i, k), _at(W, i, k + 3), _at(W, j, at), _at(W, j, at + 3)
    _put(W, j, to, _plus(_at(W, j, to), _plus(_cross(w, z), _cross(y, u))))
    _put(W, j, to + 3, _plus(_at(W, j, to + 3), _cross(w, u)))


@compiled
def _place(i, parent, q, v, table, W):  # type: ignore[no-untyped-def]
    """Rotation, origin, axis, velocity and psi of joint i."""
    turns = table[i, TURNS]
    s, c, slide = np.sin(turns * q), np.cos(turns * q), 1.0 - turns
    for a in range(3):
        if parent < 0:
            x, y, z, shift = table[i, 3 * a], table[i, 3 * a + 1], table[i, 3 * a + 2], table[i, ORIGIN + a]
        else:
            r = _at(W, parent, _R + 3 * a)
            x = r[0] * table[i, 0] + r[1] * table[i, 3] + r[2] * table[i, 6]
            y = r[0] * table[i, 1] + r[1] * table[i, 4] + r[2] * table[i, 7]
            z = r[0] * table[i, 2] + r[1] * table[i, 5] + r[2] * table[i, 8]
            shift = W[parent, _O + a] + _dot(r, _at(table, i, ORIGIN))
        _put(W, i, _R + 3 * a, (c * x + s * y, c * y - s * x, z))
        W[i, _O + a] = shift + slide * q * z
    z = (W[i, _R + 2], W[i, _R + 5], W[i, _R + 8])
    y = _cross(_at(W, i, _O), z)
    for a in range(3):
        W[i, _S + a], W[i, _S + 3 + a] = turns * y[a] + slide * z[a], turns * z[a]
    for a in range(6):
        W[i, _V + a], W[i, _PSI + a] = v * W[i, _S + a], 0.0
    if parent >= 0:
        _add_product(W, parent, _V, i, _S, _PSI)
        for a in range(6):
            W[i, _V + a] += W[parent, _V + a]


@compiled
def _weigh(i, table, W):  # type: ignore[no-untyped-def]
    """Mass, h, Sigma, p and Gamma of body i."""
    m, v, w, o = table[i, MASS], _at(W, i, _V), _at(W, i, _V + 3), _at(W, i, _O)
    own = _turned(W, i, _R, _at(table, i, FIRST))
    h = (own[0] + m * o[0], own[1] + m * o[1], own[2] + m * o[2])
    W[i, _M] = m
    _put(W, i, _H, h)
    for a in range(3):
        r = _at(W, i, _R + 3 * a)
        x = r[0] * table[i, SECOND] + r[1] * table[i, SECOND + 3] + r[2] * table[i, SECOND + 6]
        y = r[0] * table[i, SECOND + 1] + r[1] * table[i, SECOND + 4] + r[2] * table[i, SECOND + 7]
        z = r[0] * table[i, SECOND + 2] + r[1] * table[i, SECOND + 5] + r[2] * table[i, SECOND + 8]
        for b in range(3):
            W[i, _SIGMA + 3 * a + b] = _dot((x, y, z), _at(W, i, _R + 3 * b)) + o[a] * own[b] + h[a] * o[b]
    p, hv = _cross(w, h), _dot(h, v)
    for b in range(3):
        W[i, _P + b] = m * v[b] + p[b]
        x = _cross(w, _at(W, i, _SIGMA + 3 * b))
        for a in range(3):
            W[i, _GAMMA + 3 * a + b] = (hv if a == b else 0.0) - x[a] - v[a] * h[b]
    for k in range(13):
        W[i, _OWN + k] = W[i, _M + k]


@compiled
def _push(i, parent, v, acceleration, gravity, W):  # type: ignore[no-untyped-def]
    """Acceleration of body i, gravity in it, and its force."""
    for k in range(6):
        W[i, _A + k] = v * W[i, _PSI + k] + acceleration * W[i, _S + k]
    if parent < 0:
        for k in range(3):
            W[i, _A + k] -= gravity[k]
    else:
        for k in range(6):
            W[i, _A + k] += W[parent, _A + k]
    y, w = _at(W, i, _V), _at(W, i, _V + 3)
    force, moment = _times_inertia(W, i, _OWN, _at(W, i, _A), _at(W, i, _A + 3))
    p, L = _times_inertia(W, i, _OWN, y, w)
    _put(W, i, _F, _plus(force, _cross(w, p)))
    _put(W, i, _F + 3, _plus(moment, _plus(_cross(w, L), _cross(y, p))))


@compiled
def _sum_up(parents, first, W):  # type: ignore[no-untyped-def]
    """Sums of the columns from `first` on over all bodies behind each joint."""
    for j in range(len(parents) - 1, -1, -1):
        if parents[j] >= 0:
            for k in range(first, _OWN):
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
        force, moment = _times_inertia(W, j, _M, _at(W, j, _S), _at(W, j, _S + 3))
        i = j
        while i >= 0:
            M[j, i] = _dot(_at(W, i, _S), force) + _dot(_at(W, i, _S + 3), moment)
            i = parents[i]
        M[j, j] += table[j, ARMATURE]
        a[j] = 0.0
    _invert(M, inverse)
    for j in range(n):
        x = tau[j] - _dot(_at(W, j, _S), _at(W, j, _F)) - _dot(_at(W, j, _S + 3), _at(W, j, _F + 3))
        for i in range(n):
            a[i] += inverse[i, j] * x


@compiled
def _add_torque_derivatives(j, parents, gravity, W, by_q, by_v):  # type: ignore[no-untyped-def]
    """Derivatives of the torques of the motion in the work space: row j and column j, as far as joints before it go."""
    y, w, about, p, f = _at(W, j, _S), _at(W, j, _S + 3), _at(W, j, _PSI + 3), _at(W, j, _P), _at(W, j, _F)
    i = parents[j]
    if i < 0:
        _put(W, j, _CHI, _cross(w, (gravity[0], gravity[1], gravity[2])))
        _put(W, j, _CHI + 3, (0.0, 0.0, 0.0))
    else:
        for k in range(6):
            W[j, _CHI + k] = 0.0
        _add_product(W, i, _A, j, _S, _CHI)
        _add_product(W, i, _V, j, _PSI, _CHI)
    a, b = _times_inertia(W, j, _M, _at(W, j, _CHI), _at(W, j, _CHI + 3))
    c, d = _cross(about, p), _turned(W, j, _GAMMA, about)
    a = _plus(_plus(a, _plus(c, c)), _cross(w, f))
    b = _plus(_plus(b, _plus(d, d)), _plus(_cross(w, _at(W, j, _F + 3)), _cross(y, f)))
    c, d = _times_inertia(W, j, _M, _at(W, j, _PSI), about)
    c, d = _plus(c, _cross(w, p)), _plus(d, _turned(W, j, _GAMMA, w))
    force, moment = _times_inertia(W, j, _M, y, w)
    # B_j' S_j has an angular part alone
    g0, g1, g2, e = _at(W, j, _GAMMA), _at(W, j, _GAMMA + 3), _at(W, j, _GAMMA + 6), _cross(p, y)
    back = (
        e[0] + g0[0] * w[0] + g1[0] * w[1] + g2[0] * w[2],
        e[1] + g0[1] * w[0] + g1[1] * w[1] + g2[1] * w[2],
        e[2] + g0[2] * w[0] + g1[2] * w[1] + g2[2] * w[2],
    )
    i = j
    while i >= 0:
        y, w, about = _at(W, i, _S), _at(W, i, _S + 3), _at(W, i, _PSI + 3)
        by_q[j, i] = 2.0 * _dot(back, about) + _dot(force, _at(W, i, _CHI)) + _dot(moment, _at(W, i, _CHI + 3))
        by_v[j, i] = 2.0 * (_dot(back, w) + _dot(force, _at(W, i, _PSI)) + _dot(moment, about))
        by_q[i, j] = _dot(y, a) + _dot(w, b)
        by_v[i, j] = 2.0 * (_dot(y, c) + _dot(w, d))
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
    W, M, inverse = np.empty((n, _WORK)), np.empty((n, n)), np.empty((n, n))
    tau_q, tau_v = np.zeros((n, n)), np.zeros((n, n))
    for k in range(m):
        for i in range(n):
            _place(i, parents[i], q[k, i], v[k, i], table, W)
            _weigh(i, table, W)
            _push(i, parents[i], v[k, i], 0.0, gravity, W)
        _sum_up(parents, _M, W)
        _solve(parents, table, tau[k], W, M, inverse, a[k])
        if len(by_q) == 0:
            continue
        for i in range(n):
            _push(i, parents[i], v[k, i], a[k, i], gravity, W)
        _sum_up(parents, _F, W)
        for j in range(n):
            _add_torque_derivatives(j, parents, gravity, W, tau_q, tau_v)
        for i in range(n):
            for j in range(n):
                x, y = 0.0, 0.0
                for c in range(n):
                    x -= inverse[i, c] * tau_q[c, j]
                    y -= inverse[i, c] * tau_v[c, j]
                by_q[k, i, j], by_v[k, i, j], M_inverse[k, i, j] = x, y, inverse[i, j]
