# SPDX-License-Identifier: BSD-3-Clause
"""A wrong gear ratio where the bag was written: encoder angles are scaled; a factor of -1 is a wrong sign."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import EffectError
from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class WrongGear(SimulatedEffect):
    """The bag holds factor times what the encoders of the owner read; the controller works with the right angles."""

    id = "wrong_gear"
    acts_on = ("joint", "robot")
    defaults: ClassVar[Mapping[str, float]] = {"factor": 1.1}
    null = 1.0
    mistake = True

    def _check(self, name: str, value: float) -> None:
        super()._check(name, value)
        if value == 0:
            raise EffectError(f"effect {self.id}@{self.owner}: {name} must not be zero")

    def logged(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """Scaled angles, shape (m, n_joints) [rad]."""
        scaled, channels = np.array(values), self.encoder_channels(sensor)
        scaled[:, channels] *= self.parameters["factor"]
        return scaled
