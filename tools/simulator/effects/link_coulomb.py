# SPDX-License-Identifier: BSD-3-Clause
"""Coulomb friction between the link and its base.

With dry friction it is the engine's friction loss, which sticks; with smooth friction mu tanh(sharpness v), as the
motors have it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import Address, SimulatedEffect
from jointscope.tools.simulator.world.specification import add_dry_friction


class LinkCoulomb(SimulatedEffect):
    """Friction of constant torque on the link."""

    id = "link_coulomb"
    acts_on = ("joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"torque": 0.8}  # [N m]
    never_negative = ("torque",)

    def edit(self, spec: Any) -> None:
        """Gives the link's joint friction loss, unless friction is smooth."""
        if self.friction == "dry" and self.parameters["torque"] > 0:
            add_dry_friction(spec.joint(self.owner), self.parameters["torque"])

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers the link's velocity."""
        self._dof, self._qvel, self._passive = address.link[self.owner], data.qvel, data.qfrc_passive
        self._smooth = self.parameters["torque"] if self.friction == "smooth" else 0.0
        self._sharpness = self.robot.sharpness_of(self.owner)

    def torque(self) -> None:
        """Adds the smooth friction."""
        self._passive[self._dof] -= self._smooth * math.tanh(self._sharpness * self._qvel[self._dof])
