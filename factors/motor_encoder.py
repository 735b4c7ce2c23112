# SPDX-License-Identifier: BSD-3-Clause
"""Motor encoder, eq. (20) of Schuethe, Wenk, Frese (2016): theta_measured - q_motor - zero.

Variables: X at the time of the sample.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Linearization, Samples
from jointscope.robots.sensors import MotorEncoder

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MotorEncoderFactor:
    """Residual = predicted - measured motor angle.

    Attributes:
        sensor: the encoder.
        measured: angles, shape (m, n) [rad].
    """

    sensor: MotorEncoder
    measured: Array

    states = 1
    blocks = ()

    def __len__(self) -> int:
        return len(self.measured)

    @property
    def name(self) -> str:
        """Name of the sensor."""
        return self.sensor.name

    @property
    def rows(self) -> tuple[str, ...]:
        """Channels."""
        return self.sensor.channels

    @property
    def sigmas(self) -> Array:
        """Noise of each channel, shape (n,) [rad]."""
        return np.full(self.measured.shape[1], self.sensor.sigma)

    def select(self, samples: Samples) -> MotorEncoderFactor:
        """The same factor for some of the samples."""
        return replace(self, measured=self.measured[samples])

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, n) [rad]."""
        n = self.measured.shape[1]
        return x[0][:, 2 * n : 3 * n] + self.sensor.zero - self.measured

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and its constant derivative."""
        m, n = self.measured.shape
        by_state = np.zeros((m, n, 4 * n))
        by_state[:, np.arange(n), 2 * n + np.arange(n)] = 1.0
        return Linearization(self.residual(x, calibration), (by_state,))
