# SPDX-License-Identifier: BSD-3-Clause
"""The clock of a sensor, or of all sensors, is ahead of the clock of the commands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class ClockOffset(SimulatedEffect):
    """Stamps are late by a constant; the controller, which does not read stamps, sees none of it."""

    id = "clock_offset"
    acts_on = ("imu", "robot")
    defaults: ClassVar[Mapping[str, float]] = {"offset": 3e-3}  # [s]

    def taken_at(self, sensor: Sensor, stamps: Array) -> Array:
        """True times of the samples, shape (m,) [s]."""
        return stamps - self.parameters["offset"] if self.sensed_by(sensor) else stamps
