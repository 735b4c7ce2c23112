# SPDX-License-Identifier: BSD-3-Clause
"""Friction that differs with the direction, as in a worn or preloaded gear."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import Address
from jointscope.tools.simulator.world.rotor_friction import RotorFriction


class AsymmetricFriction(RotorFriction):
    """`torque` more friction of the rotor forwards, the same less backwards."""

    id = "asymmetric_friction"
    defaults: ClassVar[Mapping[str, float]] = {"torque": 0.6}  # [N m]

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers how sharp the change is."""
        super().bind(model, data, address)
        self._torque = self.parameters["torque"]

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m]."""
        return self._torque * math.tanh(self.sharpness * v)
