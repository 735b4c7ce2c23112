# SPDX-License-Identifier: BSD-3-Clause
"""Moving one joint moves another one's spring, as with belts over the axes before: more terms in its tendon."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.specification import spring_tendon

NEIGHBOUR = 0.03  # [rad/rad] from the joint before, by default


class KinematicCoupling(SimulatedEffect):
    """The owner's deflection is q_link - q_motor - sum of from_<joint> q_link over the other joints.

    The engine makes the reaction on the other links of its own.
    """

    id = "kinematic_coupling"
    acts_on = ("joint",)
    loads_at_rest = True

    def default_parameters(self) -> Mapping[str, float]:
        """from_<joint> [rad/rad] for every other joint; only the one before (for the first: after) is not zero."""
        joints = self.robot.joints
        if len(joints) < 2:
            raise EffectError(f"effect {self.id}@{self.owner}: robot {self.robot.name!r} has no other joint")
        own = joints.index(self.owner)
        neighbour = joints[own - 1] if own else joints[1]
        return {f"from_{joint}": NEIGHBOUR * (joint == neighbour) for joint in joints if joint != self.owner}

    def edit(self, spec: Any) -> None:
        """Adds the other links to the spring's tendon."""
        tendon = spec.tendon(spring_tendon(self.owner))
        for name, ratio in self.parameters.items():
            if ratio != 0:
                tendon.wrap_joint(name.removeprefix("from_"), -ratio)
