# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a gear that grows with the weight behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, smooth_abs

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

WIDTH = 1e-5  # [N m] load below which the corner is rounded


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-(c1 |s| + c2 s^2) tanh(k v_motor) [N m], with the load s at rest."""
    load = s.tau_spring
    growth = p["coefficient"] * smooth_abs(load, WIDTH) + p["quadratic"] * load * load
    return -growth * np.tanh(s.sharpness * s.v_motor)


@dataclass(frozen=True, kw_only=True)
class WeightDependentFriction(JointTorque):
    """Needs a weight, and a spring: a rigid joint's only load is its weight already."""

    def may_act_on(self, robot: RobotView, owner: str) -> str:
        """Why it cannot act on an owner; empty if it can."""
        if owner in robot.joints and not robot.tree.gravity.any():
            return f"needs gravity, which {robot.tree.urdf.name} is modelled without; use load_dependent_friction"
        if owner in robot.choices.rigid_joints:
            return f"is load_dependent_friction where {owner} is rigid"
        return super().may_act_on(robot, owner)


EFFECT = WeightDependentFriction(
    id="weight_dependent_friction",
    side="motor",
    load="weight",
    law=law,
    bends="smoothly",
    parameters=(
        EffectParameter("coefficient", "1", start=0.02, prior_sigma=5.0, sign="+"),
        EffectParameter("quadratic", "1/(N m)", start=0.0, prior_sigma=5.0),
    ),
    example={"coefficient": 0.1, "quadratic": 0.002},
    card=Card(
        title="friction by the weight it carries",
        law="b a_motor = ... - (c1 |s| + c2 s^2) tanh(k v_motor), with c1 = coefficient, c2 = quadratic and the load "
        "at rest s = T^T (g(q) - J^T F), in motor coordinates",
        explanation="What the arm and a load on it weigh presses on the bearings and teeth of the gear, in motion as "
        "at rest.",
        source="Ho, Kisner (BioRob), eq. (12) to (14) and fig. 5: stiction as a function of the gravity of the posture",
        typical="0.05 to 0.3 for geared and rope-driven arms",
        excitation="motion and rests in postures with small and with large weight",
        look_alikes={
            "load_dependent_friction": "in slow motion the spring transmits the weight and nothing else",
        },
    ),
)
