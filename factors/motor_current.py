# SPDX-License-Identifier: BSD-3-Clause
"""Currents of the motors, a second witness of their torques.

    residual = g u / k_i - k_e v_motor + offset - i_measured

Variables: X with the command that acts behind it (see driven.py), and dynamics: constants of the drives and of the
sensor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.factor import Linearization
from jointscope.factors.sensor_factor import SensorFactor
from jointscope.robots.model.motor_currents import MotorCurrents
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MotorCurrentFactor(SensorFactor[MotorCurrent]):
    """Residual = predicted - measured currents; measured has shape (m, n) [A].

    Attributes:
        currents: of the robot.
        layout: of the states.
    """

    currents: MotorCurrents
    layout: StateLayout

    blocks = (DYNAMICS,)

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, n) [A]; x has shape (m, d + n)."""
        v, u = self._signals(x[0])
        return self.currents.value(v, u, self.currents.named(calibration.values)) - self.measured

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        v, u = self._signals(x[0])
        values = self.currents.named(calibration.values)
        by_u, by_v = self.currents.slopes(values)
        m, n = u.shape
        joints, by_state = np.arange(n), np.zeros((m, n, x[0].shape[1]))
        by_state[:, joints, self.layout.motor_v] = by_v
        by_state[:, joints, self.layout.size + joints] = by_u
        by_block = {DYNAMICS: self.currents.by_parameter(v, u, values) * calibration.value_by_coordinate}
        return Linearization(self.currents.value(v, u, values) - self.measured, (by_state,), by_block)

    def _signals(self, x: Array) -> tuple[Array, Array]:
        """Speeds of the motors and acting commands, shape (m, n) each."""
        return x[:, self.layout.motor_v], x[:, self.layout.size :]
