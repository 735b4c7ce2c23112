# SPDX-License-Identifier: BSD-3-Clause
"""Gyro readings are older than their stamps, as after a filter in the sensor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class GyroDelay(SimulatedEffect):
    """A gyro is late."""

    id = "gyro_delay"
    acts_on = ("imu",)
    defaults: ClassVar[Mapping[str, float]] = {"delay": 4e-3}  # [s]
    never_negative = ("delay",)

    def age(self, sensor: Sensor) -> Array:
        """The delay of all three axes [s]."""
        return np.full(len(sensor.channels), self.parameters["delay"] if self.sensed_by(sensor) else 0.0)
