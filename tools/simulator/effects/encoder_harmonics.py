# SPDX-License-Identifier: BSD-3-Clause
"""An encoder that reads the sine and the cosine of a multiple of its angle, and both have offsets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import EffectError
from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class EncoderHarmonics(SimulatedEffect):
    """Adds cos cos(N q) + sin sin(N q) to first order, N the periods per turn; offsets are N times as large."""

    id = "encoder_harmonics"
    acts_on = ("joint", "joint seen on the link")
    defaults: ClassVar[Mapping[str, float]] = {"cos": 3e-3, "sin": 4e-3, "order": 4.0}  # [rad], [rad], [1]
    above_zero = ("order",)

    def _check(self, name: str, value: float) -> None:
        super()._check(name, value)
        offset = self.parameters["order"] * math.hypot(self.parameters["cos"], self.parameters["sin"])
        if offset >= 0.5:
            raise EffectError(
                f"effect {self.id}@{self.owner}: the offsets would be {offset:.3g} of the signals, order times the "
                "size; expected less than half, else periods are miscounted"
            )

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Angles as the two signals show them, shape (m, channels) [rad]."""
        cos, sin, order = (self.parameters[name] for name in ("cos", "sin", "order"))
        read = np.array(values)
        for channel in self.encoder_channels(sensor):
            phase = order * values[:, channel]
            x, y = np.cos(phase) - order * sin, np.sin(phase) + order * cos
            # the periods that were counted are the angle's
            left = y * np.cos(phase) - x * np.sin(phase), x * np.cos(phase) + y * np.sin(phase)
            read[:, channel] += np.arctan2(*left) / order
        return read
