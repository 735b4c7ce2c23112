# SPDX-License-Identifier: BSD-3-Clause
"""One step outwards over a joint: where its body is, how it moves, what it weighs, and the force that moves it.

All vectors are in the axes of the base and about its origin. A motion is (linear, angular). The work space has a row
for each joint; its columns begin AT_R, AT_O, ...
"""

from __future__ import annotations

import numpy as np

from jointscope.robots.bodies.joint_table import FIRST, MASS, ORIGIN, SECOND, TURNS
from jointscope.robots.compiled import compiled

# columns of the work space, a row for each joint: pose and motions; sums over all bodies behind it; the body's own
AT_R, AT_O, AT_S, AT_V, AT_A, AT_PSI, AT_CHI, AT_ALL = np.cumsum((0, 9, 3, 6, 6, 6, 6, 6))
AT_M, AT_H, AT_SIGMA, AT_P, AT_GAMMA, AT_F, AT_OWN, COLUMNS = AT_ALL + np.cumsum((0, 1, 3, 9, 3, 9, 6, 13))


@compiled
def cross(a, b):  # type: ignore[no-untyped-def]
    """A x b of vectors as tuples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def plus(a, b):  # type: ignore[no-untyped-def]
    """A + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def dot(a, b):  # type: ignore[no-untyped-def]
    """A . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def vector(W, i, k):  # type: ignore[no-untyped-def]
    """Three columns from k on."""
    return W[i, k], W[i, k + 1], W[i, k + 2]


@compiled
def put(W, i, k, a):  # type: ignore[no-untyped-def]
    """Writes a vector into three columns from k on."""
    W[i, k], W[i, k + 1], W[i, k + 2] = a


@compiled
def turned(W, i, k, x):  # type: ignore[no-untyped-def]
    """A matrix of nine columns from k on times x."""
    return dot(vector(W, i, k), x), dot(vector(W, i, k + 3), x), dot(vector(W, i, k + 6), x)


@compiled
def times_inertia(W, i, k, y, w):  # type: ignore[no-untyped-def]
    """(m y + w x h, h x y + (tr Sigma - Sigma) w) where m, h and Sigma begin in column k."""
    m, h, trace = W[i, k], vector(W, i, k + 1), W[i, k + 4] + W[i, k + 8] + W[i, k + 12]
    a, b, c = cross(w, h), cross(h, y), turned(W, i, k + 4, w)
    return (
        (m * y[0] + a[0], m * y[1] + a[1], m * y[2] + a[2]),
        (b[0] + trace * w[0] - c[0], b[1] + trace * w[1] - c[1], b[2] + trace * w[2] - c[2]),
    )


@compiled
def add_product(W, i, k, j, at, to):  # type: ignore[no-untyped-def]
    """Adds motion k of joint i times motion `at` of joint j to motion `to` of joint j."""
    y, w, z, u = vector(W, i, k), vector(W, i, k + 3), vector(W, j, at), vector(W, j, at + 3)
    put(W, j, to, plus(vector(W, j, to), plus(cross(w, z), cross(y, u))))
    put(W, j, to + 3, plus(vector(W, j, to + 3), cross(w, u)))


@compiled
def place(i, parent, q, v, table, W):  # type: ignore[no-untyped-def]
    """Rotation, origin, axis, velocity and psi of joint i."""
    turns = table[i, TURNS]
    s, c, slide = np.sin(turns * q), np.cos(turns * q), 1.0 - turns
    for a in range(3):
        if parent < 0:
            x, y, z, shift = table[i, 3 * a], table[i, 3 * a + 1], table[i, 3 * a + 2], table[i, ORIGIN + a]
        else:
            r = vector(W, parent, AT_R + 3 * a)
            x = r[0] * table[i, 0] + r[1] * table[i, 3] + r[2] * table[i, 6]
            y = r[0] * table[i, 1] + r[1] * table[i, 4] + r[2] * table[i, 7]
            z = r[0] * table[i, 2] + r[1] * table[i, 5] + r[2] * table[i, 8]
            shift = W[parent, AT_O + a] + dot(r, vector(table, i, ORIGIN))
        put(W, i, AT_R + 3 * a, (c * x + s * y, c * y - s * x, z))
        W[i, AT_O + a] = shift + slide * q * z
    z = (W[i, AT_R + 2], W[i, AT_R + 5], W[i, AT_R + 8])
    y = cross(vector(W, i, AT_O), z)
    for a in range(3):
        W[i, AT_S + a], W[i, AT_S + 3 + a] = turns * y[a] + slide * z[a], turns * z[a]
    for a in range(6):
        W[i, AT_V + a], W[i, AT_PSI + a] = v * W[i, AT_S + a], 0.0
    if parent >= 0:
        add_product(W, parent, AT_V, i, AT_S, AT_PSI)
        for a in range(6):
            W[i, AT_V + a] += W[parent, AT_V + a]


@compiled
def weigh(i, table, W):  # type: ignore[no-untyped-def]
    """Mass, h, Sigma, p and Gamma of body i."""
    m, v, w, o = table[i, MASS], vector(W, i, AT_V), vector(W, i, AT_V + 3), vector(W, i, AT_O)
    own = turned(W, i, AT_R, vector(table, i, FIRST))
    h = (own[0] + m * o[0], own[1] + m * o[1], own[2] + m * o[2])
    W[i, AT_M] = m
    put(W, i, AT_H, h)
    for a in range(3):
        r = vector(W, i, AT_R + 3 * a)
        x = r[0] * table[i, SECOND] + r[1] * table[i, SECOND + 3] + r[2] * table[i, SECOND + 6]
        y = r[0] * table[i, SECOND + 1] + r[1] * table[i, SECOND + 4] + r[2] * table[i, SECOND + 7]
        z = r[0] * table[i, SECOND + 2] + r[1] * table[i, SECOND + 5] + r[2] * table[i, SECOND + 8]
        for b in range(3):
            W[i, AT_SIGMA + 3 * a + b] = dot((x, y, z), vector(W, i, AT_R + 3 * b)) + o[a] * own[b] + h[a] * o[b]
    p, hv = cross(w, h), dot(h, v)
    for b in range(3):
        W[i, AT_P + b] = m * v[b] + p[b]
        x = cross(w, vector(W, i, AT_SIGMA + 3 * b))
        for a in range(3):
            W[i, AT_GAMMA + 3 * a + b] = (hv if a == b else 0.0) - x[a] - v[a] * h[b]
    for k in range(13):
        W[i, AT_OWN + k] = W[i, AT_M + k]


@compiled
def push(i, parent, v, acceleration, gravity, W):  # type: ignore[no-untyped-def]
    """Acceleration of body i, gravity in it, and its force."""
    for k in range(6):
        W[i, AT_A + k] = v * W[i, AT_PSI + k] + acceleration * W[i, AT_S + k]
    if parent < 0:
        for k in range(3):
            W[i, AT_A + k] -= gravity[k]
    else:
        for k in range(6):
            W[i, AT_A + k] += W[parent, AT_A + k]
    y, w = vector(W, i, AT_V), vector(W, i, AT_V + 3)
    force, moment = times_inertia(W, i, AT_OWN, vector(W, i, AT_A), vector(W, i, AT_A + 3))
    p, L = times_inertia(W, i, AT_OWN, y, w)
    put(W, i, AT_F, plus(force, cross(w, p)))
    put(W, i, AT_F + 3, plus(moment, plus(cross(w, L), cross(y, p))))
