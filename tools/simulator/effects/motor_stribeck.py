# SPDX-License-Identifier: BSD-3-Clause
"""Stribeck effect: dry friction is larger at standstill and falls as a film of lubricant builds up."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from jointscope.tools.simulator.world.rotor_friction import RotorFriction


class MotorStribeck(RotorFriction):
    """More friction of the rotor about standstill: torque exp(-(v_motor/velocity)^2)."""

    id = "motor_stribeck"
    defaults: ClassVar[Mapping[str, float]] = {"torque": 1.5, "velocity": 0.1}  # [N m], [rad/s]
    never_negative = ("torque",)
    above_zero = ("velocity",)

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m]."""
        return self.parameters["torque"] * math.exp(-((v / self.parameters["velocity"]) ** 2))
