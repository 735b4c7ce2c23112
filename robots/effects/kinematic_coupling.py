# SPDX-License-Identifier: BSD-3-Clause
"""Cables and belts that run over other joints: elements of the matrix between motor and joint angles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.transmission_elements import FROM, TransmissionElements

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView


@dataclass(frozen=True, kw_only=True)
class KinematicCoupling(TransmissionElements):
    """One coefficient for each of the other joints."""

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """The joints, if there is more than one."""
        return robot.joints if robot.n > 1 else ()

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """from_<joint> of every joint but the owner, unless that element is a parameter of the robot file already."""
        (pattern,) = self.parameters
        others = [
            joint for joint in robot.joints if joint != owner and f"{owner}.{FROM}{joint}" not in robot.parameters
        ]
        return tuple(replace(pattern, name=FROM + joint) for joint in others)


EFFECT = KinematicCoupling(
    id="kinematic_coupling",
    parameters=(EffectParameter("from_<joint>", "rad/rad", start=0.0, prior_sigma=10.0),),
    example={"from_joint1": 0.1, "from_joint2": 0.1, "from_joint3": 0.1},
    card=Card(
        title="transmission over other joints",
        law="q_link = T q_motor while no spring is stretched; from_<joint j> is added to the element (owner, j) of T. "
        "Springs see A q_link - q_motor with A = T^-1, links feel A^T (K deflection + D d(deflection)/dt)",
        explanation="A cable or belt passes over a pulley on the axis of another joint; when that joint turns, it "
        "winds up on the pulley and pulls at the owner. The reaction follows from virtual work.",
        source="Ho, Kisner (BioRob), eq. (1) to (5), the idler pulley of joint 4",
        typical="ratio of the idler's radius to the joint's pulley: 0.3 to 1; small for a pulley beside the axis",
        excitation="motion of the other joints while the owner's motor stands",
        look_alikes={
            "inertia_error": "a wrong product of inertia couples the joints, too, but with the acceleration",
            "bearing_flexibility": "a soft bearing lets other joints move the owner's body",
        },
    ),
)
