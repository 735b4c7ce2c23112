# SPDX-License-Identifier: BSD-3-Clause
"""Two axes of a gyro are swapped where the bag was written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import EffectError
from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]

SWAPS = {0: (0, 1, 2), 12: (1, 0, 2), 13: (2, 1, 0), 23: (0, 2, 1)}  # order of the axes by the digits of `swap`


class SwappedAxes(SimulatedEffect):
    """The bag holds two axes of a gyro in each other's place: 12 is x and y, 13 x and z, 23 y and z, 0 none."""

    id = "swapped_axes"
    acts_on = ("imu",)
    defaults: ClassVar[Mapping[str, float]] = {"swap": 12}
    mistake = True

    def _check(self, name: str, value: float) -> None:
        super()._check(name, value)
        if value not in SWAPS:
            raise EffectError(
                f"effect {self.id}@{self.owner}: swap must be 12 (x and y), 13 (x and z) or 23 (y and z), got {value:g}"
            )

    def logged(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Rates in the wrong order, shape (m, 3) [rad/s]."""
        return values[:, list(SWAPS[int(self.parameters["swap"])])] if self.sensed_by(sensor) else values
