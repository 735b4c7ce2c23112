# SPDX-License-Identifier: BSD-3-Clause
"""Encoder readings are older than their stamps; the controller gets the old ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class EncoderDelay(SimulatedEffect):
    """The encoder of one joint, or those of all, are late."""

    id = "encoder_delay"
    acts_on = ("joint", "robot")
    defaults: ClassVar[Mapping[str, float]] = {"delay": 2e-3}  # [s]
    never_negative = ("delay",)

    def age(self, sensor: Sensor) -> Array:
        """The delay of the owner's channels [s]."""
        age = np.zeros(len(sensor.channels))
        age[self.encoder_channels(sensor)] = self.parameters["delay"]
        return age
