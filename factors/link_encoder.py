# SPDX-License-Identifier: BSD-3-Clause
"""Link encoder, behind the transmission: theta_measured - q_link - zero.

Variables: X at the time of the sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Linearization
from jointscope.factors.sensor_factor import SensorFactor
from jointscope.robots.sensors import LinkEncoder
from jointscope.robots.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinkEncoderFactor(SensorFactor[LinkEncoder]):
    """Residual = predicted - measured link angle; measured has shape (m, n) [rad].

    Attributes:
        layout: of the states.
    """

    layout: StateLayout

    @property
    def blocks(self) -> tuple[str, ...]:
        """None: the zero of the encoder is known."""
        return ()

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, n) [rad]."""
        return x[0][:, self.layout.joint_q] + self.sensor.zero - self.measured

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and its constant derivative."""
        m, n = self.measured.shape
        by_state = np.zeros((m, n, self.layout.size))
        by_state[:, np.arange(n), self.layout.joint_q] = 1.0
        return Linearization(self.residual(x, calibration), (by_state,))
