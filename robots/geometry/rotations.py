# SPDX-License-Identifier: BSD-3-Clause
"""Many rotations at once: of quaternions, as rotation vectors, their mean, and how far they are from it.

Those that are not there are NaN and stay so, which the rotations of scipy do not take.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.body_rates import skew

Array = NDArray[np.float64]
SMALL = 1e-4  # [rad] below which a series is nearer than the formula


def of_quaternions(xyzw: Array) -> Array:
    """Rotations of quaternions of norm one, shape (m, 4), x, y, z, w, as matrices, shape (m, 3, 3)."""
    x, y, z, w = xyzw.T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def quaternion_xyzw(R: Array) -> Array:
    """The quaternion x, y, z, w of one rotation, shape (4,); of both that one with w above zero."""
    xyzw = np.array(pin.Quaternion(R).coeffs())
    return xyzw if xyzw[3] >= 0.0 else -xyzw


def rotation_vectors(R: Array) -> Array:
    """Log of rotations of shape (m, 3, 3), shape (m, 3) [rad]; those of less than half a turn."""
    twice = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    sine, cosine = 0.5 * np.linalg.norm(twice, axis=1), 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0)
    angle = np.arctan2(sine, cosine)
    ratio = np.where(angle < SMALL, 1.0 + angle**2 / 6.0, angle / np.maximum(sine, 1e-300))
    return np.asarray(0.5 * ratio[:, None] * twice)


def log_slopes(r: Array) -> Array:
    """Derivative of Log(exp(w) exp(r)) by w at zero, shape (m, 3, 3).

    1 - [r] / 2 + (1 / t^2 - (1 + cos t) / (2 t sin t)) [r]^2,  t = |r|

    Args:
        r: rotation vectors, shape (m, 3) [rad].
    """
    t = np.maximum(np.linalg.norm(r, axis=1), SMALL)
    factor = 1.0 / t**2 - (1.0 + np.cos(t)) / (2.0 * t * np.sin(t))
    K = skew(r)
    return np.asarray(np.eye(3) - 0.5 * K + factor[:, None, None] * (K @ K))


def mean_rotation(R: Array) -> Array:
    """The rotation that is nearest to some, shape (3, 3): their mean, made a rotation by its singular values."""
    U, _, Vt = np.linalg.svd(R.mean(axis=0))
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)


def spread(R: Array) -> float:
    """How far rotations are from their mean, root mean square [rad]."""
    r = rotation_vectors(mean_rotation(R).T @ R)
    return float(np.sqrt(np.mean(np.sum(r**2, axis=1))))


def roll_pitch_yaw(R: Array) -> Array:
    """Of one rotation, shape (3,) [rad]: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    return np.array(pin.rpy.matrixToRpy(R))


def of_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Array:
    """The rotation, shape (3, 3), of angles [rad]."""
    return np.array(pin.rpy.rpyToMatrix(roll, pitch, yaw))
