# SPDX-License-Identifier: BSD-3-Clause
"""What torque the motors of a flexible arm need for a motion, line by line.

    tau = Z(w) m,   Z = kappa - kappa E' A^-1 E kappa - w^2 J + j w f,   A = -w^2 M + j w C + G + diag(k + j w d)

kappa is k + j w d of the drives, E picks them from the coordinates of the arm. The frequency response of Neubauer et
al. 2015, eq. 9, is -w^2 Z^-1. It is the arm under small motion; moving_arm.py has it as it moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.geometry.flexible_arm import FlexibleArm, Spring

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
    s, kappa = 1j * w[:, None], arm.dynamic(w, values)
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
