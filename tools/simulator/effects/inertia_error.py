# SPDX-License-Identifier: BSD-3-Clause
"""The URDF's inertia of a body is wrong: the engine gets another one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.inertia import is_possible
from jointscope.tools.simulator.world.specification import link_body

SHARE = 0.08  # of each moment, by default


class InertiaError(SimulatedEffect):
    """Moments of inertia of the body that a joint moves, about the axes of the joint's frame, beyond the URDF's."""

    id = "inertia_error"
    acts_on = ("joint",)

    def default_parameters(self) -> Mapping[str, float]:
        """A share of the URDF's moments [kg m2]; all by the same share, so that no rule of inertias is broken."""
        inertia = self.robot.tree.model.inertias[self.robot.tree.model.getJointId(self.owner)].inertia
        return {f"i{a}{a}": SHARE * float(inertia[k, k]) for k, a in enumerate("xyz")}

    def edit(self, spec: Any) -> None:
        """Changes the moments of the body."""
        body, change = spec.body(link_body(self.owner)), np.zeros(6)
        change[:3] = list(self.parameters.values())
        inertia = np.array(body.fullinertia) + change
        if not is_possible(inertia):
            moments = ", ".join(f"{moment:g}" for moment in inertia[:3])
            raise EffectError(f"effect {self.id}@{self.owner}: no body has the moments of inertia {moments} kg m2")
        body.fullinertia = inertia
