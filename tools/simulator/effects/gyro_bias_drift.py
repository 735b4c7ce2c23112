# SPDX-License-Identifier: BSD-3-Clause
"""The bias of a gyro runs away, as while the sensor warms up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class GyroBiasDrift(SimulatedEffect):
    """The bias changes linearly with time; that of the truth is the one at the start of the recording."""

    id = "gyro_bias_drift"
    acts_on = ("imu",)
    defaults: ClassVar[Mapping[str, float]] = {"x": 2e-4, "y": -2e-4, "z": 1.5e-4}  # [rad/s^2]

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Rates with the change of the bias, shape (m, 3) [rad/s]."""
        if not self.sensed_by(sensor):
            return values
        return values + np.outer(stamps, [self.parameters[axis] for axis in "xyz"])
