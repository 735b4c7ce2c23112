# SPDX-License-Identifier: BSD-3-Clause
"""A spring that pulls harder one way than the other: a second tendon with the engine's polynomial stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import add_curve


class SpringCurve(SimulatedEffect):
    """Torque quadratic d^2 + cubic d^3 beside that of the linear spring, d = q_link - q_motor."""

    id = "spring_curve"
    acts_on = ("elastic joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"quadratic": 600.0, "cubic": 20000.0}  # [N m/rad^2], [N m/rad^3]

    def edit(self, spec: Any) -> None:
        """Adds a tendon between link and rotor that has no linear part."""
        terms = self.parameters["quadratic"], self.parameters["cubic"]
        add_curve(spec, self.id, self.owner, self.shares[self.owner], terms)
