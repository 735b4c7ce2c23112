# SPDX-License-Identifier: BSD-3-Clause
"""A spring that hardens or softens with its deflection: a second tendon with the engine's polynomial stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import add_curve


class SpringCubic(SimulatedEffect):
    """Torque stiffness (q_link - q_motor)^3 beside that of the linear spring; it may be negative."""

    id = "spring_cubic"
    acts_on = ("elastic joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"stiffness": 20000.0}  # [N m/rad^3]

    def edit(self, spec: Any) -> None:
        """Adds a tendon between link and rotor whose stiffness is cubic only."""
        add_curve(spec, self.id, self.owner, self.shares[self.owner], (0.0, self.parameters["stiffness"]))
