# SPDX-License-Identifier: BSD-3-Clause
"""The clock of a sensor, or of all sensors, runs faster than the clock of the commands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class ClockDrift(SimulatedEffect):
    """A stamp is the true time times 1 + drift; both clocks agree at the start of the recording."""

    id = "clock_drift"
    acts_on = ("imu", "robot")
    defaults: ClassVar[Mapping[str, float]] = {"drift": 2e-4}  # [s/s]

    def taken_at(self, sensor: Sensor, stamps: Array) -> Array:
        """True times of the samples, shape (m,) [s]."""
        return stamps / (1.0 + self.parameters["drift"]) if self.sensed_by(sensor) else stamps
