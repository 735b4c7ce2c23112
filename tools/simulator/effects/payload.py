# SPDX-License-Identifier: BSD-3-Clause
"""Something is fixed to the last body that the URDF does not know: a point mass on its long axis, or at the target."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.inertia import long_axis
from jointscope.tools.simulator.world.specification import link_body

DISTANCE = 0.5  # [m] from the joint; only mass times its square is told, so the mass follows


class Payload(SimulatedEffect):
    """A point mass that adds `inertia` about both axes across the long one; of the robot, `mass` at its target."""

    id = "payload"
    acts_on = ("last joint", "robot with a target")
    defaults: ClassVar[Mapping[str, float]] = {"inertia": 0.03}  # [kg m2]
    never_negative = ("inertia", "mass")

    def default_parameters(self) -> Mapping[str, float]:
        """A mass [kg] where its place is known."""
        return {"mass": 2.0} if self.owner == "robot" else self.defaults

    def edit(self, spec: Any) -> None:
        """Welds a body to the one that carries it."""
        if self.owner == "robot":
            self._at_target(spec)
            return
        if self.parameters["inertia"] == 0:
            return
        body = spec.body(link_body(self.owner))
        axis = long_axis(np.array(body.fullinertia))
        body.add_body(
            name=f"{self.owner}.payload",
            pos=DISTANCE * axis,
            ipos=np.zeros(3),  # the engine would take `pos` a second time
            explicitinertial=True,
            mass=self.parameters["inertia"] / DISTANCE**2,
            inertia=[1e-9] * 3,  # [kg m2] a point, as near as the engine allows
        )

    def _at_target(self, spec: Any) -> None:
        tree, poses = self.robot.tree, self.robot.poses
        assert poses is not None
        frame = tree.model.frames[tree.frame_id(poses.link)]
        if self.parameters["mass"] > 0:
            spec.body(link_body(tree.model.names[frame.parentJoint])).add_body(
                name="robot.payload",
                pos=np.array(frame.placement.translation) + np.array(frame.placement.rotation) @ poses.at,
                ipos=np.zeros(3),
                explicitinertial=True,
                mass=self.parameters["mass"],
                inertia=[1e-9] * 3,
            )
