# SPDX-License-Identifier: BSD-3-Clause
"""A constant torque on a motor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """A constant [N m]."""
    return p["torque"] * np.ones_like(s.v_motor)


EFFECT = JointTorque(
    id="torque_offset",
    side="motor",
    law=law,
    bends="never",
    parameters=(EffectParameter("torque", "N m", start=0.0, prior_sigma=100.0),),
    example={"torque": 1.0},
    card=Card(
        title="constant torque on the motor side",
        law="b a_motor = ... + tau_0, with tau_0 = torque",
        explanation="The amplifier has an offset, or a cable or a preloaded spring pulls at the motor always the same "
        "way.",
        source="Khalil, Dombre (2002), Modeling, Identification and Control of Robots, chapter on the identification "
        "of the dynamic parameters",
        typical="0 to 5 % of the rated torque",
        excitation="rests and slow motion in both directions at several positions",
        look_alikes={
            "spring_slack": "while the spring is loaded one way, slack of its rope takes a constant torque",
            "asymmetric_friction": "while the motor moves both are a constant torque",
            "parallel_spring": "near one position the spring is a constant torque",
            "gravity_imbalance": "near one position the weight is a constant torque, too",
            "gravity_direction": "near one posture the weight is a constant torque",
            "friction_by_direction": "while the motor moves both are nearly a constant torque",
        },
    ),
)
