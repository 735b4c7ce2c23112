# SPDX-License-Identifier: BSD-3-Clause
"""What the sensor factors share: one sample touches one state, its noise is the sensor's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.factor import Samples
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Accelerometer, Gyro, LinkEncoder, MotorEncoder, TorqueSensor

Array = NDArray[np.float64]
AnySensor = TypeVar(
    "AnySensor", Accelerometer, Gyro, LinkEncoder, MotorCurrent, MotorEncoder, PositionTarget, TorqueSensor
)


@dataclass(frozen=True)
class SensorFactor(Generic[AnySensor]):
    """Residual = predicted - measured.

    Attributes:
        sensor: the sensor.
        measured: samples, shape (m, c), SI unit of the sensor.
    """

    sensor: AnySensor
    measured: Array

    states = 1

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
        """Noise of each row, shape (r,), SI unit of the sensor."""
        return self.sensor.sigmas

    def select(self, samples: Samples) -> Self:
        """The same factor for some of the samples."""
        return replace(self, measured=self.measured[samples])
