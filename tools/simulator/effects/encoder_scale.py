# SPDX-License-Identifier: BSD-3-Clause
"""An encoder whose counts are turned into angles with a wrong number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class EncoderScale(SimulatedEffect):
    """Angles times 1 + scale, in the bag and for the controller alike."""

    id = "encoder_scale"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"scale": 0.02}  # [1]

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Angles as the encoder counts them, shape (m, n_joints) [rad]."""
        read, channels = np.array(values), self.encoder_channels(sensor)
        read[:, channels] *= 1.0 + self.parameters["scale"]
        return read
