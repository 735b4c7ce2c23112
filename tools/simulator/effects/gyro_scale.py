# SPDX-License-Identifier: BSD-3-Clause
"""A gyro that shows too much or too little on each axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class GyroScale(SimulatedEffect):
    """Rates times 1 + scale along the sensor's axes; the bias is not scaled."""

    id = "gyro_scale"
    acts_on = ("imu",)
    defaults: ClassVar[Mapping[str, float]] = {"x": 0.02, "y": -0.02, "z": 0.015}  # [1]

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Rates as the gyro shows them, shape (m, 3) [rad/s]."""
        if not self.sensed_by(sensor):
            return values
        return values * (1.0 + np.array([self.parameters[axis] for axis in "xyz"]))
