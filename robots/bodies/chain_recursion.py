# SPDX-License-Identifier: BSD-3-Clause
"""Angular velocity of what sits on the last joint of a chain, sample by sample; equations as in body_rates.py.

In the axes of the base, with z_j the axis of joint j and omega_j the rate before it:

    omega = sum of z_j v_j,   d/dv_j = z_j,   and as the sensor turns along: d/dq_j = omega_j x z_j
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.joint_table import TURNS
from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def body_rates(
    chain: NDArray[np.intp],
    table: Array,
    R_sensor_axes: Array,
    q: Array,
    v: Array,
    omega: Array,
    by_q: Array,
    by_v: Array,
) -> None:
    """Rates of a sensor, and their derivatives where there is room for them.

    Args:
        chain: joints from the base to the sensor.
        table: rows of a `JointTable`, shape (n, 27).
        R_sensor_axes: rotation from the frame of the last joint's row to the sensor, shape (3, 3).
        q: positions, shape (m, n) [rad] or [m].
        v: velocities, shape (m, n).
        omega: receives the rates in the axes of the sensor, shape (m, 3) [rad/s].
        by_q: receives their derivatives by q, shape (m, 3, n), or of length 0.
        by_v: the same by v.
    """
    m, wanted = len(q), len(by_q) > 0
    R, z, before, T, rate = (
        np.empty((3, 3)),
        np.empty((len(chain), 3)),
        np.empty((len(chain), 3)),
        np.empty((3, 3)),
        np.empty(3),
    )
    by_q[:], by_v[:] = 0.0, 0.0
    for k in range(m):
        for a in range(3):
            rate[a] = 0.0
            for b in range(3):
                R[a, b] = 1.0 if a == b else 0.0
        for i in range(len(chain)):
            joint = chain[i]
            turns = table[joint, TURNS]
            s, c = np.sin(turns * q[k, joint]), np.cos(turns * q[k, joint])
            for a in range(3):
                r0, r1, r2 = R[a, 0], R[a, 1], R[a, 2]
                x = r0 * table[joint, 0] + r1 * table[joint, 3] + r2 * table[joint, 6]
                y = r0 * table[joint, 1] + r1 * table[joint, 4] + r2 * table[joint, 7]
                R[a, 2] = r0 * table[joint, 2] + r1 * table[joint, 5] + r2 * table[joint, 8]
                R[a, 0], R[a, 1] = c * x + s * y, c * y - s * x
                z[i, a], before[i, a] = turns * R[a, 2], rate[a]
            for a in range(3):
                rate[a] += z[i, a] * v[k, joint]
        for a in range(3):
            for b in range(3):
                T[a, b] = R_sensor_axes[a, 0] * R[b, 0] + R_sensor_axes[a, 1] * R[b, 1] + R_sensor_axes[a, 2] * R[b, 2]
            omega[k, a] = T[a, 0] * rate[0] + T[a, 1] * rate[1] + T[a, 2] * rate[2]
        if not wanted:
            continue
        for i in range(len(chain)):
            joint = chain[i]
            x = before[i, 1] * z[i, 2] - before[i, 2] * z[i, 1]
            y = before[i, 2] * z[i, 0] - before[i, 0] * z[i, 2]
            w = before[i, 0] * z[i, 1] - before[i, 1] * z[i, 0]
            for a in range(3):
                by_q[k, a, joint] = T[a, 0] * x + T[a, 1] * y + T[a, 2] * w
                by_v[k, a, joint] = T[a, 0] * z[i, 0] + T[a, 1] * z[i, 1] + T[a, 2] * z[i, 2]
