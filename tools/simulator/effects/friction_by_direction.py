# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a rotor with other dry and viscous parts in each direction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointscope.tools.simulator.world.rotor_friction import RotorFriction


class FrictionByDirection(RotorFriction):
    """`torque` and `coefficient` |v| more friction forwards, the same less backwards."""

    id = "friction_by_direction"
    defaults: ClassVar[Mapping[str, float]] = {"torque": 0.4, "coefficient": 0.6}  # [N m], [N m s/rad]

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m]."""
        more = self.parameters["torque"] + self.parameters["coefficient"] * abs(v)
        return more if v > 0.0 else -more if v < 0.0 else 0.0
