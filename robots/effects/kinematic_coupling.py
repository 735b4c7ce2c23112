# SPDX-License-Identifier: BSD-3-Clause
"""Cables and belts that run over other joints: their motion turns the owner's end of the transmission, too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.robot_torque import RobotSignals, RobotTorque

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

PREFIX = "from_"


def law(s: RobotSignals, p: Mapping[str, Any]) -> tuple[Any, Any]:
    """What the coupled spring adds to the base model's, on both sides of all joints.

    With delta = q_link_o - q_motor_o - sum c_j q_link_j and tau = K delta + D d(delta)/dt, the potential K delta^2 / 2
    gives -tau on link o, +tau on motor o and +c_j tau on link j; the base model has the first two without the sum.

    Returns:
        tau_link and tau_motor, shape (m, n) each [N m].
    """
    o = s.owner
    coefficient = [p.get(PREFIX + joint, 0.0) for joint in s.joints]
    others = [j for j in range(len(s.joints)) if j != o]
    shift = sum((coefficient[j] * s.q_link[:, j] for j in others), np.zeros(len(s.q_link)))
    shift_rate = sum((coefficient[j] * s.v_link[:, j] for j in others), np.zeros(len(s.q_link)))
    K, D = s.stiffness[o], s.damping[o]
    change = K * shift + D * shift_rate
    tau = K * (s.q_link[:, o] - s.q_motor[:, o]) + D * (s.v_link[:, o] - s.v_motor[:, o]) - change
    zero = np.zeros_like(tau)
    tau_link = np.stack([change if j == o else coefficient[j] * tau for j in range(len(s.joints))], axis=1)
    tau_motor = np.stack([-change if j == o else zero for j in range(len(s.joints))], axis=1)
    return tau_link, tau_motor


@dataclass(frozen=True, kw_only=True)
class KinematicCoupling(RobotTorque):
    """One coefficient for each of the other joints."""

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """The joints, if there is more than one."""
        return robot.joints if robot.n > 1 else ()

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """from_<joint> of every joint but the owner."""
        (pattern,) = self.parameters
        return tuple(replace(pattern, name=PREFIX + joint) for joint in robot.joints if joint != owner)


EFFECT = KinematicCoupling(
    id="kinematic_coupling",
    law=law,
    parameters=(EffectParameter("from_<joint>", "rad/rad", start=0.0, prior_sigma=10.0),),
    example={"from_joint1": 0.1, "from_joint2": 0.1, "from_joint3": 0.1},
    card=Card(
        title="transmission that runs over other joints",
        law="deflection = q_link - q_motor - sum_j c_j q_link,j with c_j = from_<joint j>; each joint j feels "
        "c_j (K deflection + D d(deflection)/dt)",
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
