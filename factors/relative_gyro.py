# SPDX-License-Identifier: BSD-3-Clause
"""The paper's second gyro: predicted from the measured rate of the first, eqs. (25) to (29).

    residual = R_imu2 (R_body_reference(q) omega_1 + omega_relative(q, v)) + bias_2 - omega_2_measured
    omega_1  = R_imu1^T (omega_1_measured - bias_1)

Variables: X at the time of the sample, rotations and biases of both gyros. Feeding measured rates into the
prediction hides every motion of the first body that the model does not know. The frames are those of the chain
z, y, -x: eq. (29) as printed is not a rotation, and (26) as printed forgets the bias that (23) subtracts.
Schuethe, Wenk, Frese (2016).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration, bias_block, rotation_block
from jointscope.factors.factor import Linearization, Samples
from jointscope.factors.sensor_factor import SensorFactor
from jointscope.robots.bodies.body_rates import skew
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.parts.sensors import Gyro
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RelativeGyroFactor(SensorFactor[Gyro]):
    """Residual = rate predicted from another gyro and the joints in between - measured rate.

    Attributes:
        tree: rigid bodies, without hinges of bearings.
        layout: of the states.
        reference: the gyro further down the tree, on the body that the first joint moves.
        measured_reference: rates of `reference` at the same times, shape (m, 3) [rad/s].
    """

    tree: RigidTree
    layout: StateLayout
    reference: Gyro
    measured_reference: Array

    @property
    def blocks(self) -> tuple[str, ...]:
        """Rotations and biases of both gyros."""
        own, other = self.name, self.reference.name
        return (rotation_block(other), rotation_block(own), bias_block(other), bias_block(own))

    def select(self, samples: Samples) -> Self:
        """The same factor for some of the samples."""
        return replace(self, measured=self.measured[samples], measured_reference=self.measured_reference[samples])

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, 3) [rad/s]."""
        return self.linearize(x, calibration).residual

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        m, n, layout = len(self.measured), self.tree.n, self.layout
        q, v = x[0][:, layout.joint_q], x[0][:, layout.joint_v]
        own, other = self.name, self.reference.name
        R_own, R_other = calibration[rotation_block(own)], calibration[rotation_block(other)]
        v_between = v.copy()
        v_between[:, 0] = 0.0
        omega_relative, by_q, by_v = self.tree.body_rate(self.sensor.body, q, v_between)
        by_q, by_v = by_q.copy(), by_v.copy()
        omega_1 = (self.measured_reference - calibration[bias_block(other)]) @ R_other
        R_body_reference = self._R_body_reference(q)
        carried = np.einsum("kij,kj->ki", R_body_reference, omega_1)
        # turning a joint in between turns the body away from the carried rate, about the joint's axis in the body
        for j in range(1, n):
            by_q[:, :, j] -= np.cross(by_v[:, :, j], carried)
        by_v[:, :, 0] = 0.0
        omega_body = carried + omega_relative
        by_state = np.zeros((m, 3, layout.size))
        by_state[:, :, layout.joint_q] = R_own @ by_q
        by_state[:, :, layout.joint_v] = R_own @ by_v
        by_block = {
            rotation_block(own): -R_own @ skew(omega_body),
            bias_block(own): np.broadcast_to(np.eye(3), (m, 3, 3)),
            rotation_block(other): R_own @ R_body_reference @ skew(omega_1),
            bias_block(other): -R_own @ R_body_reference @ R_other.T,
        }
        residual = omega_body @ R_own.T + calibration[bias_block(own)] - self.measured
        return Linearization(residual, (by_state,), by_block)

    def _R_body_reference(self, q: Array) -> Array:
        """Rotation from the reference gyro's body to this body, shape (m, 3, 3)."""
        R_base_body, _ = self.tree.body_poses(self.sensor.body, q)
        R_base_reference, _ = self.tree.body_poses(self.reference.body, q)
        return R_base_body.transpose(0, 2, 1) @ R_base_reference
