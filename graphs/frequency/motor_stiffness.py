# SPDX-License-Identifier: BSD-3-Clause
"""What torque the motors of a flexible arm need for a motion, line by line.

    tau = Z(w) m,   Z = kappa - kappa E' A^-1 E kappa - w^2 J + j w f,   A = -w^2 M + j w C + G + diag(k + j w d)

kappa is k + j w d of the drives, E picks them from the coordinates of the arm. The frequency response of Neubauer et
al. 2015, eq. 9, is -w^2 Z^-1. About a motion that carries the excitation, M, C and G change with its phase: a line then
answers lines that are multiples of that motion beside it, and A becomes a band of blocks (Wereley, 1990).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from jointscope.robots.geometry.flexible_arm import FlexibleArm, Linearised, Spring

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class MotorStiffness:
    """Dynamic stiffness of the motors.

    Attributes:
        Z: torques by turns of the motors, rotors and springs alone, shape (l, nu, nu) [N m/rad].
        by_spring: its derivative by k + j w d of each spring, shape (s, l, nu, nu).
        turned: turns of the coordinates by turns of the motors, shape (l, n, nu).
        pulled: torques of the motors by what pulls at the coordinates, shape (l, nu, n).
    """

    Z: Complex
    by_spring: Complex
    turned: Complex
    pulled: Complex

    def by_parts(self, w: Array, slopes: tuple[Array, Array, Array], motion: Complex) -> Complex:
        """Torques for a motion that changes of M, C and G add, by one each.

        Args:
            w: of the lines, shape (l,) [rad/s].
            slopes: of M, C and G by some values, shape (v, n, n) each.
            motion: of the motors, shape (e, l, nu) [rad].

        Returns:
            Shape (v, e, l, nu).
        """
        x = self.turned @ motion.transpose(1, 2, 0)  # (l, n, e)
        dM, dC, dG = (np.tensordot(part, x, axes=(2, 1)) for part in slopes)  # (v, n, l, e)
        at = w[:, None]
        pull = -(at**2) * dM + 1j * at * dC + dG
        return np.asarray((self.pulled @ pull.transpose(0, 2, 1, 3)).transpose(0, 3, 1, 2))


def motor_stiffness(
    arm: FlexibleArm, parts: tuple[Array, Array, Array], w: Array, values: Mapping[str, float]
) -> MotorStiffness:
    """The stiffness of an arm that stands.

    Args:
        arm: its springs.
        parts: M, C and G.
        w: of the lines, shape (l,) [rad/s].
        values: of all parameters by name.
    """
    M, C, G = parts
    s = 1j * w[:, None]
    kappa = np.array([values[x.stiffness] for x in arm.springs]) + s * [values[x.damping] for x in arm.springs]
    n, E = len(M), arm.driven
    A = -(w**2)[:, None, None] * M + s[:, :, None] * C + G + kappa[:, :, None] * np.eye(n)
    own = kappa[:, E]
    inverse = np.linalg.inv(A)
    X = inverse[:, :, E] * own[:, None, :]  # of the coordinates by the motors
    T = own[:, :, None] * inverse[:, E]  # of the torques by what pulls at the coordinates
    eye = np.eye(len(E))
    Z = own[:, :, None] * (eye - X[:, E]) - (w**2)[:, None, None] * np.diag(_inertias(arm, values))
    by_spring = np.array([_column(x, T, eye)[:, :, None] * _row(x, X, eye)[:, None, :] for x in arm.springs])
    return MotorStiffness(Z, by_spring, X, T)


def _column(spring: Spring, T: Complex, eye: Array) -> Complex:
    own = 0.0 if spring.motor is None else eye[spring.motor]
    return np.asarray((own - T[:, :, spring.coordinate]) * (-1.0 if spring.motor is None else 1.0))


def _row(spring: Spring, X: Complex, eye: Array) -> Complex:
    return np.asarray(X[:, spring.coordinate] if spring.motor is None else eye[spring.motor] - X[:, spring.coordinate])


def _inertias(arm: FlexibleArm, values: Mapping[str, float]) -> Array:
    return np.array([values[f"{joint}.inertia"] for joint in arm.joints])


def carried_torque(
    arm: FlexibleArm, about: Linearised, f0: float, step: int, motion: Complex, values: Mapping[str, float]
) -> Complex:
    """Torques of springs and rotors when a motion at line `step` carries the excitation.

    Args:
        arm: its springs.
        about: the arm about that motion.
        f0: distance of the lines [Hz].
        step: line of the carrying motion.
        motion: of the motors at the lines 0, 1, 2, ..., shape (e, K, nu) [rad].
        values: of all parameters by name.

    Returns:
        Torques at the same lines, shape (e, K, nu) [N m].
    """
    w = np.asarray(2.0 * np.pi * f0 * np.arange(motion.shape[1]), dtype=np.float64)
    s = 1j * w[:, None]
    kappa = np.array([values[x.stiffness] for x in arm.springs]) + s * [values[x.damping] for x in arm.springs]
    own = kappa[:, arm.driven]
    pull = own * motion
    x = np.empty((motion.shape[1], len(arm.driven), len(motion)), dtype=complex)
    for first in range(step):
        lines = np.arange(first, motion.shape[1], step)
        band, width = _band(about, w[lines], kappa[lines])
        right = np.zeros((len(lines), kappa.shape[1], len(motion)), dtype=complex)
        right[:, arm.driven] = np.moveaxis(pull[:, lines], 0, 2)
        solved = solve_banded((width, width), band, right.reshape(-1, len(motion)), overwrite_ab=True, overwrite_b=True)
        x[lines] = solved.reshape(right.shape)[:, arm.driven]
    rotors = -(w**2)[:, None] * _inertias(arm, values)
    return np.asarray(own * (motion - np.moveaxis(x, 2, 0)) + rotors * motion)


def _band(about: Linearised, w: Array, kappa: Complex) -> tuple[Complex, int]:
    """Blocks of neighbouring lines as LAPACK's band, and its width."""
    harmonics, n, count = len(about.M) // 2, about.M.shape[1], len(w)
    width = n * harmonics + n - 1
    band = np.zeros((2 * width + 1, n * count), dtype=complex)
    i, j = np.divmod(np.arange(n * n), n)
    for h in range(-harmonics, harmonics + 1):
        columns = np.arange(max(0, -h), min(count, count - h))  # line `columns` drives line `columns + h`
        at = w[columns][:, None, None]
        block = -(at**2) * about.M[h + harmonics] + 1j * at * about.C[h + harmonics] + about.G[h + harmonics]
        if h == 0:
            block = block + kappa[:, :, None] * np.eye(n)
        row, column = n * (columns + h)[:, None] + i, n * columns[:, None] + j
        band[width + row - column, column] = block.reshape(len(columns), -1)
    return band, width
