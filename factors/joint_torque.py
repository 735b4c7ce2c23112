# SPDX-License-Identifier: BSD-3-Clause
"""Torque sensors in elastic joints, or the torque that a drive computes from its spring.

    residual = scale tau(X) + offset - tau_measured,    tau = K (q_motor - q_link) + D (v_motor - v_link) + effects

Variables: X at the time of the sample, and dynamics: springs, their effects, and scale and offset of each joint where
the robot file has them as parameters (else 1 and 0).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.factor import Linearization
from jointscope.factors.sensor_factor import SensorFactor
from jointscope.robots.dynamics.spring_torques import SpringTorques
from jointscope.robots.parts.sensors import TorqueSensor

Array = NDArray[np.float64]


@dataclass(frozen=True)
class JointTorqueFactor(SensorFactor[TorqueSensor]):
    """Residual = predicted - measured torque; measured has shape (m, n) [N m].

    Attributes:
        springs: of the robot.
    """

    springs: SpringTorques

    blocks = (DYNAMICS,)

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, n) [N m]."""
        values = self.springs.named(calibration.values)
        scale, offset = self.sensor.scale_and_offset(values)
        return scale * self.springs.value(x[0], values) + offset - self.measured

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        values = self.springs.named(calibration.values)
        scale, offset = self.sensor.scale_and_offset(values)
        torque, by_state, by_parameter = self.springs.with_derivatives(x[0], values)
        by_parameter = scale[:, None] * by_parameter
        for j, (of_scale, of_offset) in enumerate(self.sensor.parameters):
            for name, slope in ((of_scale, torque[:, j]), (of_offset, 1.0)):
                if name in calibration.names:
                    by_parameter[:, j, calibration.names.index(name)] += slope
        by_block = {DYNAMICS: by_parameter * calibration.value_by_coordinate}
        return Linearization(scale * torque + offset - self.measured, (scale[:, None] * by_state,), by_block)
