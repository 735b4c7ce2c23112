# SPDX-License-Identifier: BSD-3-Clause
"""A spring between a link and the one before it: the engine's own joint stiffness with its own rest position."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import add_linear


class ParallelSpring(SimulatedEffect):
    """Torque -stiffness q_link + torque on the link."""

    id = "parallel_spring"
    acts_on = ("joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"stiffness": 2.0, "torque": 0.5}  # [N m/rad], [N m]
    never_negative = ("stiffness",)
    loads_at_rest = True

    def edit(self, spec: Any) -> None:
        """Gives the link's joint a spring that is at rest where it makes no torque."""
        joint, stiffness = spec.joint(self.owner), self.parameters["stiffness"]
        add_linear(joint, "stiffness", stiffness)
        rest = self._rest(stiffness)
        joint.springref = math.degrees(rest) if spec.compiler.degree else rest

    def _rest(self, stiffness: float) -> float:
        """Where the spring makes no torque [rad]."""
        torque = self.parameters["torque"]
        if torque and not stiffness:
            raise EffectError(f"effect {self.id}@{self.owner}: torque {torque:g} without stiffness; give stiffness too")
        return torque / stiffness if torque else 0.0
