# SPDX-License-Identifier: BSD-3-Clause
"""Accelerometer of an IMU: specific force at its place on a body, in the axes of the IMU.

    residual = R_imu_body f_body(q_link, v_link, a_link, p_body) + bias - f_measured

Variables: X with link accelerations (see accelerated.py), rotation of the IMU's gyro, bias of the accelerometer, and
dynamics, which holds its place p_body where that is not fixed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, bias_block, rotation_block
from jointscope.factors.factor import Linearization
from jointscope.factors.sensor_factor import SensorFactor
from jointscope.robots.bodies.body_accelerations import SpecificForce, specific_force
from jointscope.robots.bodies.body_rates import skew
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.parts.sensors import Accelerometer
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AccelerometerFactor(SensorFactor[Accelerometer]):
    """Residual = predicted - measured specific force in the sensor frame; measured has shape (m, 3) [m/s^2].

    Attributes:
        tree: rigid bodies.
        layout: of the states.
        body: link that carries the IMU.
        gravity: in the base frame, shape (3,) [m/s^2].
        fixed: parameters that calibration leaves alone, by full name.
    """

    tree: RigidTree
    layout: StateLayout
    body: str
    gravity: Array
    fixed: Mapping[str, float]

    @property
    def blocks(self) -> tuple[str, ...]:
        """Rotation of the gyro, bias of this sensor, dynamics."""
        return (rotation_block(self.sensor.gyro), bias_block(self.name), DYNAMICS)

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, 3) [m/s^2]; x has shape (m, d + n_link)."""
        R = calibration.rotations[self.sensor.gyro]
        return self._force(x[0], calibration).value @ R.T + calibration.biases[self.name] - self.measured

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        m, d = len(self.measured), self.layout.size
        f, R = self._force(x[0], calibration), calibration.rotations[self.sensor.gyro]
        by_state = np.zeros((m, 3, d + self.layout.n_link))
        by_state[:, :, self.layout.q_link] = R @ f.by_q
        by_state[:, :, self.layout.v_link] = R @ f.by_v
        by_state[:, :, d:] = R @ f.by_a
        by_dynamics = np.zeros((m, 3, len(calibration.names)))
        slopes = calibration.value_by_coordinate
        for axis, name in enumerate(self.sensor.lever):
            if name in calibration.names:
                k = calibration.names.index(name)
                by_dynamics[:, :, k] = f.by_lever[:, :, axis] @ R.T * slopes[k]
        by_block = {
            rotation_block(self.sensor.gyro): -R @ skew(f.value),
            bias_block(self.name): np.broadcast_to(np.eye(3), (m, 3, 3)),
            DYNAMICS: by_dynamics,
        }
        residual = f.value @ R.T + calibration.biases[self.name] - self.measured
        return Linearization(residual, (by_state,), by_block)

    def _force(self, x: Array, calibration: Calibration) -> SpecificForce:
        values = {**self.fixed, **calibration.by_name}
        lever = np.array([values[name] for name in self.sensor.lever])
        motion = x[:, self.layout.q_link], x[:, self.layout.v_link], x[:, self.layout.size :]
        return specific_force(self.tree, self.body, lever, *motion, self.gravity)
