# SPDX-License-Identifier: BSD-3-Clause
"""Doggy's equations of motion by hand, compiled by numba: what single shooting runs on.

All bodies turn about one common point, so only angular motion counts. With J_i the angular Jacobian of body i in its
own frame, omega_i = J_i v and alpha_i = dJ_i/dt v,

    M = sum J_i' I_i J_i        c = sum J_i' (I_i alpha_i + omega_i x I_i omega_i)

and J_3 has the columns (-s2, -c2 s3, c2 c3), (0, c3, s3), (-1, 0, 0). The axes are z, y, -x. numba is allowed in the
benchmark only; `check_against` holds these formulas against pinocchio before anything is measured with them.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree

Array = NDArray[np.float64]

# order of the 12 drive parameters: k_pwm, k_mi, inertia, 3 x coulomb_torque, 3 x stiffness, 3 x damping
PARAMETERS = 12


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _times(inertia, x, y, z):
    """I w for one body."""
    return (
        inertia[0, 0] * x + inertia[0, 1] * y + inertia[0, 2] * z,
        inertia[1, 0] * x + inertia[1, 1] * y + inertia[1, 2] * z,
        inertia[2, 0] * x + inertia[2, 1] * y + inertia[2, 2] * z,
    )


@njit(cache=True, fastmath=True, error_model="numpy")
def link_acceleration(inertias, q2, q3, v1, v2, v3, t1, t2, t3):
    """M^-1 (tau - c) for joint torques t1, t2, t3 [N m]; gravity is compensated."""
    s2, c2, s3, c3 = np.sin(q2), np.cos(q2), np.sin(q3), np.cos(q3)
    ax, ay, az = -s2, -c2 * s3, c2 * c3  # first column of J_3; the first of J_2 is (-s2, 0, c2)
    I2, I3 = inertias[1], inertias[2]
    m2x, m2y, m2z = _times(I2, -s2, 0.0, c2)
    m3x, m3y, m3z = _times(I3, ax, ay, az)
    n3x, n3y, n3z = _times(I3, 0.0, c3, s3)
    M11 = inertias[0, 2, 2] - s2 * m2x + c2 * m2z + ax * m3x + ay * m3y + az * m3z
    M12 = m2y + c3 * m3y + s3 * m3z
    M13 = -m3x
    M22 = I2[1, 1] + c3 * n3y + s3 * n3z
    M23 = -n3x
    M33 = I3[0, 0]
    # body 2: its rate, what its rate becomes without joint accelerations, and the torque that this takes
    wx, wy, wz = -s2 * v1, v2, c2 * v1
    bx, bz = -c2 * v1 * v2, -s2 * v1 * v2
    hx, hy, hz = _times(I2, wx, wy, wz)
    kx, ky, kz = _times(I2, bx, 0.0, bz)
    kx, ky, kz = kx + wy * hz - wz * hy, ky + wz * hx - wx * hz, kz + wx * hy - wy * hx
    d1, d2 = -s2 * kx + c2 * kz, ky
    # body 3: the third axis adds omega_3 x (-e_x) v3
    wx, wy, wz = ax * v1 - v3, ay * v1 + c3 * v2, az * v1 + s3 * v2
    gx, gy, gz = bx, -s3 * bz - wz * v3, c3 * bz + wy * v3
    hx, hy, hz = _times(I3, wx, wy, wz)
    kx, ky, kz = _times(I3, gx, gy, gz)
    kx, ky, kz = kx + wy * hz - wz * hy, ky + wz * hx - wx * hz, kz + wx * hy - wy * hx
    r1 = t1 - d1 - ax * kx - ay * ky - az * kz
    r2 = t2 - d2 - c3 * ky - s3 * kz
    r3 = t3 + kx
    # inverse of the symmetric 3 x 3 matrix by cofactors
    C11, C12, C13 = M22 * M33 - M23 * M23, M13 * M23 - M12 * M33, M12 * M23 - M13 * M22
    C22, C23, C33 = M11 * M33 - M13 * M13, M12 * M13 - M11 * M23, M11 * M22 - M12 * M12
    scale = 1.0 / (M11 * C11 + M12 * C12 + M13 * C13)
    return (
        scale * (C11 * r1 + C12 * r2 + C13 * r3),
        scale * (C12 * r1 + C22 * r2 + C23 * r3),
        scale * (C13 * r1 + C23 * r2 + C33 * r3),
    )


@njit(cache=True, fastmath=True, error_model="numpy")
def _derivative(x, volts, p, inertias, sharpness, tau, dx):
    """dx/dt of x = (q_link, v_link, q_motor, v_motor); `tau` is scratch."""
    for i in range(3):
        tau[i] = p[6 + i] * (x[i] - x[6 + i]) + p[9 + i] * (x[3 + i] - x[9 + i])
        dx[i], dx[6 + i] = x[3 + i], x[9 + i]
        friction = p[3 + i] * np.tanh(sharpness * x[9 + i])
        dx[9 + i] = (tau[i] + p[0] * volts[i] - p[1] * x[9 + i] - friction) / p[2]
    dx[3], dx[4], dx[5] = link_acceleration(inertias, x[1], x[2], x[3], x[4], x[5], -tau[0], -tau[1], -tau[2])


@njit(cache=True, fastmath=True, error_model="numpy")
def _simulate(x0, volts, h, p, inertias, sharpness, path):
    x, y, tau = x0.copy(), np.empty(12), np.empty(3)
    k1, k2, k3, k4 = np.empty(12), np.empty(12), np.empty(12), np.empty(12)
    path[0] = x
    for k in range(len(volts)):
        _derivative(x, volts[k], p, inertias, sharpness, tau, k1)
        for i in range(12):
            y[i] = x[i] + 0.5 * h * k1[i]
        _derivative(y, volts[k], p, inertias, sharpness, tau, k2)
        for i in range(12):
            y[i] = x[i] + 0.5 * h * k2[i]
        _derivative(y, volts[k], p, inertias, sharpness, tau, k3)
        for i in range(12):
            y[i] = x[i] + h * k3[i]
        _derivative(y, volts[k], p, inertias, sharpness, tau, k4)
        for i in range(12):
            x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
        path[k + 1] = x


@njit(cache=True, fastmath=True, error_model="numpy", parallel=True)
def simulate_all(x0s, volts, h, ps, inertias, sharpness):
    """Runge-Kutta paths of several robots under the same commands, one per core at a time.

    Args:
        x0s: first states, shape (r, 12).
        volts: held over each step, shape (m, 3) [V].
        h: length of every step [s].
        ps: drive parameters, shape (r, 12), in the order of PARAMETERS.
        inertias: of the three bodies about the common point, shape (3, 3, 3) [kg m2].
        sharpness: of the friction [s/rad].

    Returns:
        States, shape (r, m + 1, 12).
    """
    paths = np.empty((len(ps), len(volts) + 1, 12))
    for r in prange(len(ps)):
        _simulate(x0s[r], volts, h, ps[r], inertias, sharpness, paths[r])
    return paths


def body_rates(path: Array) -> tuple[Array, Array]:
    """Angular velocities of bodies 1 and 3 in their own frames, shape (m, 3) each, for states of shape (m, 12)."""
    s2, c2, s3, c3 = np.sin(path[:, 1]), np.cos(path[:, 1]), np.sin(path[:, 2]), np.cos(path[:, 2])
    v1, v2, v3 = path[:, 3:6].T
    body1 = np.column_stack([np.zeros_like(v1), np.zeros_like(v1), v1])
    return body1, np.column_stack([-s2 * v1 - v3, -c2 * s3 * v1 + c3 * v2, c2 * c3 * v1 + s3 * v2])


def inertias_of(tree: RigidTree) -> Array:
    """Inertias of the three bodies about the common point, shape (3, 3, 3) [kg m2]."""
    return np.array([tree.model.inertias[j].inertia for j in range(1, 4)])


def check_against(tree: RigidTree) -> None:
    """Raises AssertionError unless the formulas above give pinocchio's accelerations and body rates."""
    rng = np.random.default_rng(0)
    q, v, tau = rng.uniform(-1.0, 1.0, (3, 50, 3)) * np.array([1.0, 3.0, 20.0])[:, None, None]
    ours = [link_acceleration(inertias_of(tree), *q[k, 1:], *v[k], *tau[k]) for k in range(len(q))]
    same = np.allclose(ours, tree.acceleration(q, v, tau), rtol=1e-9, atol=1e-9)
    rates = body_rates(np.hstack([q, v, q, v]))
    for body, rate in zip(("link1", "link3"), rates, strict=True):
        same = same and np.allclose(rate, tree.body_rate(body, q, v)[0])
    if not same:
        raise AssertionError("single shooting: the formulas by hand differ from pinocchio")
