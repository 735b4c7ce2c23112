# SPDX-License-Identifier: BSD-3-Clause
"""A link slips on what carries it, or its encoder loses its zero: the reading jumps and stays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class EncoderJump(SimulatedEffect):
    """Angles of the encoder on a link plus `size` from `time` on."""

    id = "encoder_jump"
    acts_on = ("joint seen on the link",)
    defaults: ClassVar[Mapping[str, float]] = {"size": 0.1, "time": 1.0}  # [rad], [s]
    never_negative = ("time",)
    outside_catalogue = True

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Angles before and behind the jump, shape (m, n_joints) [rad]."""
        read = np.array(values)
        read[:, self.encoder_channels(sensor)] += self.parameters["size"] * (stamps >= self.parameters["time"])[:, None]
        return read
