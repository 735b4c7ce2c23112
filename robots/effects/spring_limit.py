# SPDX-License-Identifier: BSD-3-Clause
"""A safety string beside a spring: taut beyond its length, where its stiffness joins that of the spring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, beyond_gap

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

STIFFEST = 100.0  # times the spring that a string may plausibly be
SHARES = (0.6, 0.8, 2.0)  # of the largest deflection; the last one is a side without a string
LENGTH = EffectParameter(
    "forward", "rad", start=0.03, prior_sigma=0.03, sign="+", logarithmic=True, grid=SHARES, weak=True,
    of_range="forward",
)  # fmt: skip


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """Torque of a string that is slack between -backward and forward [N m], corners rounded.

    Its length is that of the whole deflection: a rope that hangs slack beside it makes no difference to it.
    """
    return p["stiffness"] * beyond_gap(s.q_link - s.q_motor, p["backward"], p["forward"])


@dataclass(frozen=True, kw_only=True)
class SpringLimit(JointTorque):
    """The string, whose natural scale is the stiffness of the spring."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With a prior that is wide beside the joint's own stiffness."""
        linear = robot.parameters.get(f"{owner}.stiffness")
        if linear is None:
            return self.parameters
        stiffness, *lengths = self.parameters
        return (replace(stiffness, prior_sigma=STIFFEST * linear.value), *lengths)


EFFECT = SpringLimit(
    id="spring_limit",
    side="spring",
    law=law,
    parameters=(
        EffectParameter("stiffness", "N m/rad", start=0.0, prior_sigma=1e5, sign="+"),
        LENGTH,
        replace(LENGTH, name="backward", of_range="backward"),
    ),
    example={"stiffness": 400.0, "forward": 0.02, "backward": 0.03},
    card=Card(
        title="safety string that limits a spring",
        law="tau_c = (curve of the spring) + D (v_link - v_motor) + K_s (d - forward) where d > forward, + K_s (d + "
        "backward) where d < -backward; d = q_link - q_motor, K_s = stiffness",
        explanation="A string beside the spring hangs loose until the spring is stretched to the string's length; from "
        "there on it carries most of what is added. A stop of rubber, or coils that touch each other, do the same.",
        source="Ho, Kisner (BioRob), sec. 4.2 and fig. 4: safety strings in the springs limit their elongation",
        typical="three to a hundred times the stiffness of the spring, beyond most of its usual deflection",
        excitation="deflections well beyond the string's length, both ways: heavy weights, hard stops",
        look_alikes={
            "spring_cubic": "hardens towards large deflections as well, without a corner",
            "spring_curve": "hardens towards large deflections as well, without a corner",
            "spring_slack": "soft first and stiff beyond a corner; with slack the soft part has no stiffness at all",
            "spring_pieces_1": "a slope that grows towards large deflections, without a corner",
            "spring_pieces_2": "a steep last piece, without a corner",
            "spring_pieces_4": "a steep last piece is what a string does beyond its length",
        },
    ),
)
