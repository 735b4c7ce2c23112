# SPDX-License-Identifier: BSD-3-Clause
"""An elastic bumper inside the range of the joint: a spring of the engine that is slack between two angles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import set_linear


class JointStop(SimulatedEffect):
    """Beyond +-angle, the link is pushed back in proportion to how far it is beyond."""

    id = "joint_stop"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"angle": 0.45, "stiffness": 60.0}  # [rad], [N m/rad]
    never_negative = ("stiffness",)
    above_zero = ("angle",)
    outside_catalogue = True

    def edit(self, spec: Any) -> None:
        """Adds a tendon on the link's angle alone."""
        tendon = spec.add_tendon(name=f"{self.owner}.stop")
        tendon.wrap_joint(self.owner, 1.0)
        tendon.springlength = [-self.parameters["angle"], self.parameters["angle"]]
        set_linear(tendon, "stiffness", self.parameters["stiffness"])
