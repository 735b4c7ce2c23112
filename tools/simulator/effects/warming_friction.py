# SPDX-License-Identifier: BSD-3-Clause
"""Friction that falls while the gear warms up."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import Address
from jointscope.tools.simulator.world.rotor_friction import RotorFriction


class WarmingFriction(RotorFriction):
    """More friction of the rotor at first: torque exp(-t/time_constant)."""

    id = "warming_friction"
    defaults: ClassVar[Mapping[str, float]] = {"torque": 2.0, "time_constant": 15.0}  # [N m], [s]
    never_negative = ("torque",)
    above_zero = ("time_constant",)
    outside_catalogue = True

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers the engine, for its time."""
        super().bind(model, data, address)
        self._engine_data = data

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m]."""
        return self.parameters["torque"] * math.exp(-self._engine_data.time / self.parameters["time_constant"])
