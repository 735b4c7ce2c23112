# SPDX-License-Identifier: BSD-3-Clause
"""Moving one joint moves another one's spring, as with belts over the axes before.

The engine makes terms of the springs' tendons of the joint angles per motor angle.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]

NEIGHBOUR = 0.03  # [rad/rad] from the joint before, by default


class KinematicCoupling(SimulatedEffect):
    """With no spring stretched, the owner turns by from_<joint> for every turn of another joint's motor.

    The engine makes the reaction on the other links of its own.
    """

    id = "kinematic_coupling"
    acts_on = ("elastic joint",)
    built_in = True
    loads_at_rest = True

    def default_parameters(self) -> Mapping[str, float]:
        """from_<joint> [rad/rad] for every other joint; only the one before (for the first: after) is not zero."""
        joints = self.robot.joints
        if len(joints) < 2:
            raise EffectError(f"effect {self.id}@{self.owner}: robot {self.robot.name!r} has no other joint")
        own = joints.index(self.owner)
        neighbour = joints[own - 1] if own else joints[1]
        return {f"from_{joint}": NEIGHBOUR * (joint == neighbour) for joint in joints if joint != self.owner}

    def couple(self, T: Array) -> None:
        """Lets the other joints' motors move the owner's joint."""
        joints = self.robot.joints
        for name, ratio in self.parameters.items():
            T[joints.index(self.owner), joints.index(name.removeprefix("from_"))] += ratio
