# SPDX-License-Identifier: BSD-3-Clause
"""The URDF's mass of a body is wrong: the engine gets another one, and more weight beside the centre of mass."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.inertia import is_possible
from jointscope.tools.simulator.world.specification import link_body

SHARE = 0.4  # of the mass, by default


class LinkMass(SimulatedEffect):
    """More material of the same shape, then first moments [kg m] at an inertia about the joint that stays."""

    id = "link_mass"
    acts_on = ("joint",)

    def default_parameters(self) -> Mapping[str, float]:
        """A share of the URDF's mass [kg], its centre where it was."""
        mass = self.robot.tree.model.inertias[self.robot.tree.model.getJointId(self.owner)].mass
        return {"mass": SHARE * float(mass), "x": 0.0, "y": 0.0, "z": 0.0}

    def edit(self, spec: Any) -> None:
        """Changes mass, centre and inertia of the body."""
        body = spec.body(link_body(self.owner))
        more = np.array([self.parameters[axis] for axis in "xyz"])
        factor = 1.0 + self.parameters["mass"] / body.mass
        if factor <= 0.0:
            raise EffectError(f"effect {self.id}@{self.owner}: the link weighs {body.mass:g} kg only")
        mass, com = factor * body.mass, np.array(body.ipos)
        moved = com + more / mass
        inertia = factor * np.array(body.fullinertia) + mass * (_about(com) - _about(moved))
        if not is_possible(inertia):
            raise EffectError(f"effect {self.id}@{self.owner}: no body has such first moments and so little inertia")
        body.mass, body.ipos, body.fullinertia = mass, moved, inertia


def _about(p: Any) -> Any:
    """Inertia of one kilogramme at p about the origin: xx, yy, zz, xy, xz, yz, shape (6,) [m^2]."""
    I = p @ p * np.eye(3) - np.outer(p, p)  # noqa: E741
    return np.array([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]])
