# SPDX-License-Identifier: BSD-3-Clause
"""Positions are older than their stamps; the controller gets the old ones of encoders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class EncoderDelay(SimulatedEffect):
    """The encoder of one joint, those of all, all encoders on the links, or a tracker with its target are late."""

    id = "encoder_delay"
    acts_on = ("joint", "robot", "target", "link encoders")
    defaults: ClassVar[Mapping[str, float]] = {"delay": 2e-3}  # [s]
    never_negative = ("delay",)

    def age(self, sensor: Sensor) -> Array:
        """The delay of the owner's channels [s]."""
        if sensor.name == self.owner:
            return np.full(len(sensor.channels), self.parameters["delay"])
        age = np.zeros(len(sensor.channels))
        age[self.encoder_channels(sensor)] = self.parameters["delay"]
        return age
