# SPDX-License-Identifier: BSD-3-Clause
"""Torques that one more body asks for at given motion. They are linear in its ten dynamic parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.joint_recursion import AT_F, AT_S, COLUMNS, dot, place, push, vector, weigh
from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def body_torques(
    parents: NDArray[np.intp],
    table: Array,
    gravity: Array,
    joints: NDArray[np.intp],
    bodies: Array,
    q: Array,
    v: Array,
    a: Array,
    tau: Array,
) -> None:
    """Torques of samples, body by body.

    Args:
        parents: joint before each, -1 for the base, shape (n,).
        table: rows of a `JointTable`, shape (n, 27).
        gravity: acceleration in the base frame, shape (3,) [m/s^2].
        joints: row of the joint that moves each body, shape (c,).
        bodies: its row of the table, of which mass and moments count, shape (c, 27).
        q: positions, shape (m, n) [rad] or [m].
        v: velocities, shape (m, n).
        a: accelerations, shape (m, n).
        tau: zeros; receives the torques, shape (c, m, n) [N m] or [N].
    """
    m, n = q.shape
    W, row = np.zeros((n, COLUMNS)), table.copy()
    for k in range(m):
        for i in range(n):
            place(i, parents[i], q[k, i], v[k, i], table, W)
            push(i, parents[i], v[k, i], a[k, i], gravity, W)
        for c in range(len(joints)):
            i = joints[c]
            row[i] = bodies[c]
            weigh(i, row, W)
            push(i, parents[i], v[k, i], a[k, i], gravity, W)
            j = i
            while j >= 0:
                linear = dot(vector(W, j, AT_S), vector(W, i, AT_F))
                tau[c, k, j] = linear + dot(vector(W, j, AT_S + 3), vector(W, i, AT_F + 3))
                j = parents[j]
