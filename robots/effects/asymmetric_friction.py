# SPDX-License-Identifier: BSD-3-Clause
"""Friction that differs between forwards and backwards."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-a tanh(k v_motor)^2 [N m]."""
    moving = np.tanh(s.sharpness * s.v_motor)
    return -p["torque"] * moving * moving


EFFECT = JointTorque(
    id="asymmetric_friction",
    side="motor",
    law=law,
    bends="smoothly",
    parameters=(EffectParameter("torque", "N m", start=0.0, prior_sigma=100.0),),
    example={"torque": 1.0},
    card=Card(
        title="friction unlike in both directions",
        law="b a_motor = ... - a tanh(k v_motor)^2, with a = torque",
        explanation="Worm gears, belts and seals may resist more one way than the other: the Coulomb torque is mu + a "
        "forwards and mu - a backwards.",
        source="Armstrong-Helouvry, Dupont, Canudas de Wit (1994), A survey of models, analysis tools and compensation "
        "methods for the control of machines with friction, Automatica 30(7)",
        typical="up to 30 % of the Coulomb torque",
        excitation="rests between motion in both directions: while moving it is a constant torque",
        look_alikes={
            "torque_offset": "while the motor moves both are a constant torque",
            "gravity_imbalance": "near one position the weight is a constant torque, too",
            "pwm_deadband": "while accelerating, a lost command is more friction",
            "truncated_command": "while accelerating, a larger command is less friction",
            "friction_by_direction": "at one speed the viscous difference is a dry one",
        },
    ),
)
