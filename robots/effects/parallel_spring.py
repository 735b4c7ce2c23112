# SPDX-License-Identifier: BSD-3-Clause
"""A spring between a link and the one before it, beside the drive: cables, hoses, gas springs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """The preload less what the spring pulls back, tau_0 - k q_link [N m]."""
    return p["torque"] - p["stiffness"] * s.q_link


EFFECT = JointTorque(
    id="parallel_spring",
    side="link",
    law=law,
    bends="smoothly",
    parameters=(
        EffectParameter("stiffness", "N m/rad", start=0.0, prior_sigma=500.0),
        EffectParameter("torque", "N m", start=0.0, prior_sigma=500.0),
    ),
    example={"stiffness": 2.0, "torque": 0.5},
    card=Card(
        title="spring beside the drive",
        law="M a_link + c + g + tau_c = ... + tau_0 - k q_link, with k = stiffness, tau_0 = torque",
        explanation="Cables and hoses along the joint, a balancing or gas spring, or a flexure that guides it pull "
        "toward one position, more the farther the joint is from it.",
        source="Khalil, Dombre (2002), Modeling, Identification and Control of Robots, on balancing springs; Hooke's "
        "law",
        typical="cables of small arms 0.1 to 1 N m/rad; balancing springs carry most of the weight",
        excitation="slow motion and rests over the whole range of the joint",
        look_alikes={
            "gravity_imbalance": "near one position the weight changes with the angle as a spring's torque does",
            "torque_offset": "near one position the spring is a constant torque",
            "gravity_direction": "near one posture a turned weight changes with the angle, too",
        },
    ),
)
