# SPDX-License-Identifier: BSD-3-Clause
"""Ropes that hang slack: a spring that pulls one way only after its rope is taut."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, loosened

ROPE = EffectParameter("forward", "rad", start=0.005, prior_sigma=0.015, sign="+", logarithmic=True)


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """K (z - deflection) - D rate within the slack [N m], corners rounded; exactly zero without slack."""
    return loosened(s, p["backward"], p["forward"])


EFFECT = JointTorque(
    id="spring_slack",
    side="spring",
    law=law,
    gap=("backward", "forward"),
    parameters=(ROPE, replace(ROPE, name="backward")),
    example={"forward": 0.02, "backward": 0.001},
    card=Card(
        title="ropes that hang slack",
        law="tau_c = K z + D (v_link - v_motor) where a rope is taut, 0 where none is; with d = q_link - q_motor: "
        "z = d - s_f above s_f, d + s_b below -s_b; s_f = forward, s_b = backward; a curve of the spring's own starts "
        "where the rope is taut, too",
        explanation="A rope pulls and cannot push, so that a joint has one for each direction. Without prestress, or "
        "after it has stretched, one of them hangs slack: the motor turns through its slack before the link feels it, "
        "one way only or by another angle than the other way. It may slip off its pulley then.",
        source="Ho, Kisner (BioRob), app. A.1: ropes come into slacking and slip off the pulleys; sec. 4.2: static "
        "slacking bends the force-elongation curves",
        typical="0.005 to 0.3 rad of the pulley; 0 on the side of a rope with prestress",
        excitation="deflections both ways that pass through zero, many of them; rests with loads of either sign",
        look_alikes={
            "backlash": "the same where both ropes are slack by as much, or where zeros of encoders are unknown",
            "encoder_offset": "slack of one rope moves the middle of the spring, as a wrong zero does",
            "spring_curve": "an even term makes one direction soft, as slack of one rope does",
            "spring_cubic": "where both ropes are slack, both make the spring soft at small deflections",
            "torque_offset": "while the spring is loaded one way, slack of its rope takes a constant torque",
            "spring_limit": "stiff beyond a corner; beside a string the spring has a torque before it, too",
            **dict.fromkeys(
                ("spring_pieces_1", "spring_pieces_2", "spring_pieces_4"), "a first piece that is soft looks like slack"
            ),
        },
    ),
)
