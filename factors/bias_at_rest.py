# SPDX-License-Identifier: BSD-3-Clause
"""Bias at rest, eq. (32) of Schuethe, Wenk, Frese (2016): before the first command a gyro measures its bias.

Variables: bias of the gyro. Needed where a gyro's components are not all predicted (vertical, relative); a full
gyro factor knows it already.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration, bias_block
from jointscope.factors.factor import Linearization, Samples
from jointscope.robots.parts.sensors import AXES, Gyro

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BiasAtRestFactor:
    """Residual = bias - measured rate.

    Attributes:
        sensor: the gyro.
        measured: rates while the robot rests, shape (m, 3) [rad/s].
    """

    sensor: Gyro
    measured: Array

    states = 0

    def __len__(self) -> int:
        return len(self.measured)

    @property
    def name(self) -> str:
        """Name in reports."""
        return f"{self.sensor.name}.rest"

    @property
    def rows(self) -> tuple[str, ...]:
        """One row per axis."""
        return tuple(f"{self.sensor.name}.rest_{axis}" for axis in AXES)

    @property
    def blocks(self) -> tuple[str, ...]:
        """Bias of this gyro."""
        return (bias_block(self.sensor.name),)

    @property
    def sigmas(self) -> Array:
        """Noise of each component, shape (3,) [rad/s]."""
        return np.full(3, self.sensor.sigma)

    def select(self, samples: Samples) -> BiasAtRestFactor:
        """The same factor for some of the samples."""
        return replace(self, measured=self.measured[samples])

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Bias - measured, shape (m, 3) [rad/s]."""
        return calibration[bias_block(self.sensor.name)] - self.measured

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and its constant derivative."""
        by_bias = np.broadcast_to(np.eye(3), (len(self), 3, 3))
        return Linearization(self.residual(x, calibration), (), {self.blocks[0]: by_bias})
