# SPDX-License-Identifier: BSD-3-Clause
"""Balancing springs that do not balance: a zero-length spring between a point on the base and one on the link.

Such a spring between points at distances a and b from the axis gives exactly stiffness a b sin(anchor angle - q),
as a weight does, but acts between the two bodies only.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import link_body, set_linear

Array = NDArray[np.float64]

BASE_ARM, LINK_ARM = 0.10, 0.15  # [m] they differ, so that the spring always has a direction


class GravityImbalance(SimulatedEffect):
    """Torque cos cos(q_link) + sin sin(q_link) on the link, from a spatial tendon of the engine."""

    id = "gravity_imbalance"
    acts_on = ("joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"cos": 1.8, "sin": 2.4}  # [N m]
    loads_at_rest = True

    def edit(self, spec: Any) -> None:
        """Adds the two points and the spring."""
        body, joint = spec.body(link_body(self.owner)), spec.joint(self.owner)
        if joint.type != load_mujoco().mjtJoint.mjJNT_HINGE:
            raise EffectError(f"effect {self.id}@{self.owner}: only for a joint that turns")
        cos, sin = self.parameters["cos"], self.parameters["sin"]
        angle = math.atan2(cos, -sin)
        e1, e2 = _across(np.array(joint.axis))
        R_parent_joint = _rotation(np.array(body.quat))
        anchor = np.array(body.pos) + R_parent_joint @ (BASE_ARM * (math.cos(angle) * e1 + math.sin(angle) * e2))
        names = f"{self.owner}.balance_base", f"{self.owner}.balance_link"
        body.parent.add_site(name=names[0], pos=anchor)
        body.add_site(name=names[1], pos=LINK_ARM * e1)
        tendon = spec.add_tendon(name=f"{self.owner}.balance")
        for name in names:
            tendon.wrap_site(name)
        tendon.springlength = [0.0, 0.0]
        set_linear(tendon, "stiffness", math.hypot(cos, sin) / (BASE_ARM * LINK_ARM))


def _across(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors with e1 x e2 = axis."""
    axis = axis / np.linalg.norm(axis)
    e1 = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(axis, e1)


def _rotation(quaternion_wxyz: Array) -> Array:
    matrix = np.empty(9)
    load_mujoco().mju_quat2Mat(matrix, quaternion_wxyz)
    return matrix.reshape(3, 3)
