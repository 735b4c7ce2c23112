# SPDX-License-Identifier: BSD-3-Clause
"""Gyroscope on any body, all three components predicted from the state.

    residual = R_imu_body omega_body(q_link, v_link) + bias - omega_measured

Variables: X at the time of the sample, rotation and bias of the gyro. A rotation changes as R exp(delta), so the
derivative by delta is -R [omega_body]x.
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
class GyroFactor(SensorFactor[Gyro]):
    """Residual = predicted - measured angular rate in the sensor frame; measured has shape (m, 3) [rad/s].

    Attributes:
        tree: rigid bodies.
        layout: of the states.
    """

    tree: RigidTree
    layout: StateLayout

    @property
    def blocks(self) -> tuple[str, ...]:
        """Rotation and bias of this gyro."""
        return (rotation_block(self.name), bias_block(self.name))

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, 3) [rad/s]."""
        return self._predicted(x[0], calibration, derivatives=False)[0] - self.measured

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        m, layout, R = len(self.measured), self.layout, calibration[rotation_block(self.name)]
        reading, omega, by_q, by_v = self._predicted(x[0], calibration, derivatives=True)
        by_state = np.zeros((m, 3, layout.size))
        by_state[:, :, layout.q_link] = by_q
        by_state[:, :, layout.v_link] = by_v
        by_block = {
            rotation_block(self.name): (-skew(omega).reshape(3 * m, 3) @ R).reshape(m, 3, 3),  # R [w]x = [R w]x R
            bias_block(self.name): np.broadcast_to(np.eye(3), (m, 3, 3)),
        }
        return Linearization(reading - self.measured, (by_state,), by_block)

    def _predicted(self, x: Array, calibration: Calibration, derivatives: bool) -> tuple[Array, Array, Array, Array]:
        """Reading, and the rate in the sensor frame with its derivatives by link positions and velocities."""
        motion = x[:, self.layout.q_link], x[:, self.layout.v_link]
        R = calibration[rotation_block(self.name)]
        omega, by_q, by_v = self.tree.sensed_rate(self.sensor.body, R, *motion, derivatives)
        return omega + calibration[bias_block(self.name)], omega, by_q, by_v
