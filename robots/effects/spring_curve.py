# SPDX-License-Identifier: BSD-3-Clause
"""A spring whose force is a curve over its deflection, not the same in both directions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

SMALLEST_BEND = 0.03  # [rad] deflection at which no plausible term reaches the linear one


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """k2 d^2 + k3 d^3 with d = q_link - q_motor [N m]."""
    return (p["quadratic"] + p["cubic"] * s.deflection) * s.deflection * s.deflection


@dataclass(frozen=True, kw_only=True)
class SpringCurve(JointTorque):
    """Terms whose natural scale is the stiffness."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With priors that are wide beside the joint's own stiffness."""
        linear = robot.parameters.get(f"{owner}.stiffness")
        if linear is None:
            return self.parameters
        quadratic, cubic = self.parameters
        return (
            replace(quadratic, prior_sigma=linear.value / SMALLEST_BEND),
            replace(cubic, prior_sigma=linear.value / SMALLEST_BEND**2),
        )


EFFECT = SpringCurve(
    id="spring_curve",
    side="spring",
    curve="terms",
    law=law,
    bends="smoothly",
    parameters=(
        EffectParameter("quadratic", "N m/rad^2", start=0.0, prior_sigma=3e4),
        EffectParameter("cubic", "N m/rad^3", start=0.0, prior_sigma=1e6),
    ),
    example={"quadratic": 600.0, "cubic": 1000.0},
    card=Card(
        title="spring with a curve of its own",
        law="tau_c = K d + D (v_link - v_motor) + k2 d^2 + k3 d^3, with d = q_link - q_motor, k2 = quadratic "
        "and k3 = cubic",
        explanation="A rope with a spring pulls harder one way than the other: prestress, slack on one side, a safety "
        "string beside the spring. The even term tells the two directions apart.",
        source="Ho, Kisner (BioRob), eq. (9), (28) and fig. 4: force-elongation curves as polynomials",
        typical="both terms as large as the linear one at a few times the largest deflection of normal work",
        excitation="large deflections both ways: weights that pull up and down, hard stops, fast reversals",
        look_alikes={
            "spring_cubic": "the same where the curve is alike in both directions",
            "spring_slack": "an even term makes one direction soft, as slack of one rope does",
            "spring_limit": "hardens towards large deflections as well, with a corner where a string is taut",
            **dict.fromkeys(
                ("spring_pieces_1", "spring_pieces_2", "spring_pieces_4"),
                "the same over the deflections that were measured, where a third degree is enough",
            ),
        },
    ),
)
