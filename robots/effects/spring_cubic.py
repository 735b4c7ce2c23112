# SPDX-License-Identifier: BSD-3-Clause
"""A spring that gets harder, or softer, with its deflection."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

SMALLEST_BEND = 0.03  # [rad] deflection at which no plausible cubic term reaches the linear one


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """k3 (q_link - q_motor)^3 [N m]."""
    return p["stiffness"] * s.deflection * s.deflection * s.deflection


@dataclass(frozen=True, kw_only=True)
class SpringCubic(JointTorque):
    """The cubic term, whose natural scale is the stiffness."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With a prior that is wide beside the joint's own stiffness."""
        linear = robot.parameters.get(f"{owner}.stiffness")
        if linear is None:
            return self.parameters
        (cubic,) = self.parameters
        return (replace(cubic, prior_sigma=linear.value / SMALLEST_BEND**2),)


EFFECT = SpringCubic(
    id="spring_cubic",
    side="spring",
    curve="terms",
    law=law,
    bends="smoothly",
    parameters=(EffectParameter("stiffness", "N m/rad^3", start=0.0, prior_sigma=1e6),),
    example={"stiffness": 1000.0},
    card=Card(
        title="spring that hardens or softens",
        law="tau_c = K (q_link - q_motor) + D (v_link - v_motor) + k3 (q_link - q_motor)^3, with k3 = stiffness",
        explanation="Belts, cables and gear teeth get stiffer the more they are loaded; a negative value is a spring "
        "that yields, as a cable that goes slack.",
        source="Ho, Kisner (BioRob), eq. (9), (28) and fig. 4: force-elongation curves as polynomials; Tuttle, Seering "
        "(1996), A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robotics and Automation 12(3)",
        typical="as large as the linear term at a few times the largest deflection of normal work",
        excitation="large and small deflections: hard stops and chirps beside gentle motion",
        look_alikes={
            "backlash": "both make the spring soft at small and hard at large deflections",
            "spring_slack": "where both ropes are slack, both make the spring soft at small deflections",
            "spring_curve": "the same where the curve is alike in both directions",
            "spring_limit": "hardens towards large deflections as well, with a corner where a string is taut",
            **dict.fromkeys(
                ("spring_pieces_1", "spring_pieces_2", "spring_pieces_4"),
                "the same where the curve is smooth and alike",
            ),
            "hysteresis": "both change the apparent stiffness with the size of the deflection",
        },
    ),
)
