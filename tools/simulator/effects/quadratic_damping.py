# SPDX-License-Identifier: BSD-3-Clause
"""Turbulent drag on the rotor: a force of the fluid against the motion, with the square of its speed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import Address, SimulatedEffect


class QuadraticDamping(SimulatedEffect):
    """Torque of size coefficient v_motor^2 on the rotor, against its motion."""

    id = "quadratic_damping"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"coefficient": 1.0}  # [N m s^2/rad^2]
    never_negative = ("coefficient",)

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers the rotor."""
        self._dof, self._qvel, self._passive = address.motor[self.owner], data.qvel, data.qfrc_passive

    def torque(self) -> None:
        """Adds the drag of this force evaluation."""
        speed = float(self._qvel[self._dof])
        self._passive[self._dof] -= math.copysign(self.parameters["coefficient"] * speed**2, speed)
