# SPDX-License-Identifier: BSD-3-Clause
"""Friction that grows with the load of the gear: the torque of spring and damper presses the teeth together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jointscope.tools.simulator.world.effect import Address
from jointscope.tools.simulator.world.rotor_friction import RotorFriction
from jointscope.tools.simulator.world.specification import is_rigid


class LoadDependentFriction(RotorFriction):
    """More friction of the rotor, in proportion to what the engine's springs and dampers transmit to it.

    A rigid joint has none; its gear carries gravity and Coriolis torques, as the engine had them a quarter step ago.
    """

    id = "load_dependent_friction"
    defaults: ClassVar[Mapping[str, float]] = {"coefficient": 0.25}  # [1]
    never_negative = ("coefficient",)

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers the torques that the engine has computed before it calls."""
        super().bind(model, data, address)
        self._spring, self._damper = data.qfrc_spring, data.qfrc_damper
        self._carried = data.qfrc_bias if is_rigid(self.robot, self.owner) else None
        self._own_damping = float(np.ravel(model.dof_damping[self.dof])[0])  # of the rotor itself: no load of the gear

    def extra(self, q: float, v: float) -> float:
        """Friction beyond that of the robot file [N m]."""
        if self._carried is None:
            transmitted = self._spring[self.dof] + self._damper[self.dof] + self._own_damping * v
        else:
            transmitted = self._carried[self.dof]
        return self.parameters["coefficient"] * abs(transmitted)
