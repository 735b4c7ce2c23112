# SPDX-License-Identifier: BSD-3-Clause
"""An encoder that was homed at a wrong place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class EncoderOffset(SimulatedEffect):
    """Angles plus an offset, in the bag and for the controller alike; of an encoder on the link in the bag."""

    id = "encoder_offset"
    acts_on = ("joint", "joint seen on the link")
    defaults: ClassVar[Mapping[str, float]] = {"offset": 0.05}  # [rad]

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Angles from the wrong zero, shape (m, n_joints) [rad]."""
        read = np.array(values)
        read[:, self.encoder_channels(sensor)] += self.parameters["offset"]
        return read
