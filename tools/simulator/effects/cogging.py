# SPDX-License-Identifier: BSD-3-Clause
"""Cogging: the magnets of the motor pull the rotor into preferred angles, N times in a turn of the joint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from jointscope.tools.simulator.world.effect import Address, SimulatedEffect


class Cogging(SimulatedEffect):
    """Torque cos cos(N q_motor) + sin sin(N q_motor) on the rotor, N the order; one period per motor turn at first."""

    id = "cogging"
    acts_on = ("joint",)
    above_zero = ("order",)
    loads_at_rest = True

    def default_parameters(self) -> Mapping[str, float]:
        """0.8 N m, one period per turn of the motor."""
        return {"cos": 0.48, "sin": 0.64, "order": self.robot.constants.get("motor.gear", 1.0)}  # [N m], [N m], [1]

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers the rotor's angle."""
        self._dof, self._qpos, self._passive = address.motor[self.owner], data.qpos, data.qfrc_passive
        p = self.parameters
        self._order, self._amplitude = p["order"], math.hypot(p["cos"], p["sin"])
        self._phase = math.atan2(p["cos"], p["sin"])

    def torque(self) -> None:
        """Adds the torque of the magnets."""
        self._passive[self._dof] += self._amplitude * math.sin(self._order * self._qpos[self._dof] + self._phase)
