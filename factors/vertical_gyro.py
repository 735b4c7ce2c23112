# SPDX-License-Identifier: BSD-3-Clause
"""The paper's first gyro: only the rate about the axis of the first joint, eqs. (22) to (24).

    residual = v_link_1 - axis . R_imu_body^T (omega_measured - bias)

Variables: X at the time of the sample, rotation and bias of the gyro. The two other components are not looked at,
which hides a soft bearing. Schuethe, Wenk, Frese (2016); the turn into the world frame (24) is about the axis itself
and leaves the component as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration, bias_block, rotation_block
from jointscope.factors.factor import Linearization
from jointscope.factors.sensor_factor import SensorFactor
from jointscope.robots.bodies.body_rates import skew
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.parts.sensors import Gyro
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class VerticalGyroFactor(SensorFactor[Gyro]):
    """Residual = rate of the first joint - measured rate about its axis; the gyro sits on the body that it moves.

    Attributes:
        tree: rigid bodies.
        layout: of the states.
    """

    tree: RigidTree
    layout: StateLayout

    @property
    def rows(self) -> tuple[str, ...]:
        """One row."""
        return (f"{self.name}.vertical",)

    @property
    def sigmas(self) -> Array:
        """Noise of the row: that of one component, as the axis has length 1."""
        return self.sensor.sigmas[:1]

    @property
    def blocks(self) -> tuple[str, ...]:
        """Rotation and bias of this gyro."""
        return (rotation_block(self.name), bias_block(self.name))

    @property
    def axis(self) -> Array:
        """Axis of the first joint in the body's frame, shape (3,)."""
        rest = np.zeros((1, self.tree.n))
        return self.tree.body_rate(self.sensor.body, rest, rest)[2][0, :, 0]

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Residual, shape (m, 1) [rad/s]."""
        return (x[0][:, self.layout.joint_v[0]] - self._body_rate(calibration) @ self.axis)[:, None]

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        m = len(self.measured)
        by_state = np.zeros((m, 1, self.layout.size))
        by_state[:, 0, self.layout.joint_v[0]] = 1.0
        R, omega_body = calibration[rotation_block(self.name)], self._body_rate(calibration)
        by_block = {
            rotation_block(self.name): -(self.axis @ skew(omega_body))[:, None, :],
            bias_block(self.name): np.broadcast_to(self.axis @ R.T, (m, 1, 3)),
        }
        return Linearization(self.residual(x, calibration), (by_state,), by_block)

    def _body_rate(self, calibration: Calibration) -> Array:
        """Measured rate in the body's frame, shape (m, 3)."""
        return (self.measured - calibration[bias_block(self.name)]) @ calibration[rotation_block(self.name)]
