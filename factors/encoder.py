# SPDX-License-Identifier: BSD-3-Clause
"""What encoders on motors and on links share: theta_measured - q - zero, of one position for each channel.

Where an encoder has play, its lag is taken off: theta_measured - (q - lag) - zero.

Variables: X at the time of the sample.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Linearization
from jointscope.factors.sensor_factor import SensorFactor
from jointscope.robots.parts.sensors import LinkEncoder, MotorEncoder
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]
AnyEncoder = TypeVar("AnyEncoder", LinkEncoder, MotorEncoder)


@dataclass(frozen=True)
class EncoderFactor(SensorFactor[AnyEncoder]):
    """Residual = predicted - measured angle; measured has shape (m, n) [rad].

    Attributes:
        layout: of the states.
        lags: channel and column of the lag of each encoder that has play.
    """

    layout: StateLayout
    lags: tuple[tuple[int, int], ...] = ()

    @property
    @abstractmethod
    def columns(self) -> NDArray[np.intp]:
        """Column of the position that each channel measures, shape (n,)."""

    @property
    def blocks(self) -> tuple[str, ...]:
        """None: the zero of the encoder is known."""
        return ()

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, n) [rad]."""
        residual = x[0][:, self.columns] + self.sensor.zero - self.measured
        for channel, column in self.lags:
            residual[:, channel] -= x[0][:, column]
        return residual

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and its constant derivative."""
        m, n = self.measured.shape
        by_state = np.zeros((m, n, self.layout.size))
        by_state[:, np.arange(n), self.columns] = 1.0
        for channel, column in self.lags:
            by_state[:, channel, column] = -1.0
        return Linearization(self.residual(x, calibration), (by_state,))
