# SPDX-License-Identifier: BSD-3-Clause
"""The base of a joint tilts: two more hinges x, y with spring and damper sit before the joint.

The hinges turn about the two coordinate axes of the joint's frame that are across the joint's axis, first x, then y,
before the joint's own rotation. The moved body needs its transverse inertia and its products of inertia, which
motion about the joint alone never shows; they may be given here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.inertia import full_inertia, is_possible
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import joint_axis, link_body, set_linear

# What another effect may have given the joint.
PASSIVE = ("stiffness", "damping", "frictionloss", "solref_friction", "solimp_friction", "armature")
PRODUCTS = ("xy", "xz", "yz")  # z is the axis of the frame along the joint
LARGER = (1.2, 1.35)  # transverse inertia by default, over that of the URDF


class BearingFlexibility(SimulatedEffect):
    """Two sprung hinges across the axis of a joint; a compliance of zero is a rigid direction."""

    id = "bearing_flexibility"
    acts_on = ("joint",)
    built_in = True
    never_negative = ("compliance_x", "compliance_y", "damping_x", "damping_y")
    above_zero = ("inertia_x", "inertia_y")

    def default_parameters(self) -> Mapping[str, float]:
        """A soft bearing; inertias above the URDF's, which are often guessed, where a body can have that."""
        model = self.robot.tree.model
        j = model.getJointId(self.owner)
        across, full = _across(joint_axis(model, j)[0]), full_inertia(model.inertias[j].inertia)
        larger = full.copy()
        larger[across] *= LARGER
        x, y = (larger if is_possible(larger) else full)[across]
        products = full[_products(across)]
        return {
            "compliance_x": 1.0 / 2500.0,  # [rad/(N m)]
            "compliance_y": 1.0 / 3200.0,  # [rad/(N m)]
            "damping_x": 12.0,  # [N m s/rad]
            "damping_y": 14.0,  # [N m s/rad]
            "inertia_x": float(x),  # [kg m2] of the moved body about x
            "inertia_y": float(y),  # [kg m2] of the moved body about y
            **{f"product_{axes}": float(p) for axes, p in zip(PRODUCTS, products, strict=True)},  # [kg m2]
        }

    def edit(self, spec: Any) -> None:
        """Puts the hinges before the joint, and the transverse inertia on its body."""
        mujoco = load_mujoco()
        joint = spec.joint(self.owner)
        kind, axis = joint.type, np.array(joint.axis)
        passive = {name: np.copy(getattr(joint, name)) for name in PASSIVE}
        body = spec.body(link_body(self.owner))
        across = _across(axis)
        self._override_inertia(body, across)
        spec.delete(joint)  # joints of a body act in the order in which they were added
        for name, k in zip("xy", across, strict=True):
            compliance = self.parameters[f"compliance_{name}"]
            if compliance > 0:
                hinge_name = f"{self.owner}.bearing_{name}"
                hinge = body.add_joint(name=hinge_name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=np.eye(3)[k])
                set_linear(hinge, "stiffness", 1.0 / compliance)
                set_linear(hinge, "damping", self.parameters[f"damping_{name}"])
        again = body.add_joint(name=self.owner, type=kind, axis=axis)
        for name, value in passive.items():
            setattr(again, name, value)

    def _override_inertia(self, body: Any, across: NDArray[np.intp]) -> None:
        inertia = np.array(body.fullinertia)
        inertia[across] = self.parameters["inertia_x"], self.parameters["inertia_y"]
        inertia[_products(across)] = [self.parameters[f"product_{axes}"] for axes in PRODUCTS]
        if not is_possible(inertia):
            raise EffectError(
                f"effect {self.id}@{self.owner}: transverse inertias {inertia[across][0]:g} and "
                f"{inertia[across][1]:g} kg m2 and these products are impossible beside the rest of the body's inertia"
            )
        body.fullinertia = inertia


def _across(axis: NDArray[np.float64]) -> NDArray[np.intp]:
    """The two coordinate axes that are across the joint's axis, in their order."""
    return np.sort(np.argsort(np.abs(axis))[:2])


def _products(across: NDArray[np.intp]) -> NDArray[np.intp]:
    """Places of the products xy, xz, yz of inertia among the engine's six numbers."""
    (x, y), places = across, {(0, 1): 3, (0, 2): 4, (1, 2): 5}
    z = 3 - x - y
    return np.array([places[min(pair), max(pair)] for pair in ((x, y), (x, z), (y, z))])
