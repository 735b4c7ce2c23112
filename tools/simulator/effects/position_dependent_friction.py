# SPDX-License-Identifier: BSD-3-Clause
"""Friction that is larger in a part of the range, as where a cable rubs or a tooth is worn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from jointscope.tools.simulator.world.rotor_friction import RotorFriction


class PositionDependentFriction(RotorFriction):
    """More friction of the rotor about one angle: torque exp(-((q_motor - centre)/width)^2)."""

    id = "position_dependent_friction"
    defaults: ClassVar[Mapping[str, float]] = {"torque": 2.5, "centre": 0.2, "width": 0.25}  # [N m], [rad], [rad]
    never_negative = ("torque",)
    above_zero = ("width",)
    outside_catalogue = True

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m]."""
        p = self.parameters
        return p["torque"] * math.exp(-(((q - p["centre"]) / p["width"]) ** 2))
