# SPDX-License-Identifier: BSD-3-Clause
"""Dry and viscous friction that both differ between forwards and backwards."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-(a tanh(k v_motor) + e v_motor) tanh(k v_motor) [N m]."""
    moving = np.tanh(s.sharpness * s.v_motor)
    return -(p["torque"] * moving + p["coefficient"] * s.v_motor) * moving


EFFECT = JointTorque(
    id="friction_by_direction",
    side="motor",
    law=law,
    bends="smoothly",
    parameters=(
        EffectParameter("torque", "N m", start=0.0, prior_sigma=100.0),
        EffectParameter("coefficient", "N m s/rad", start=0.0, prior_sigma=50.0),
    ),
    example={"torque": 0.4, "coefficient": 0.8},
    card=Card(
        title="friction of each direction",
        law="b a_motor = ... - (a tanh(k v_motor) + e v_motor) tanh(k v_motor), with a = torque, e = coefficient",
        explanation="Friction has four numbers: dry and viscous friction forwards, mu + a and d + e, and backwards, "
        "mu - a and d - e. Seals, worm gears and preloaded screws are such. Each of the two differences has its own "
        "sigma; where e is none, asymmetric_friction says the same with one number.",
        source="Armstrong-Helouvry, Dupont, Canudas de Wit (1994), A survey of models, analysis tools and compensation "
        "methods for the control of machines with friction, Automatica 30(7), on Coulomb and viscous friction by "
        "direction",
        typical="up to 30 % of either friction",
        excitation="motion in both directions at several speeds, and rests between",
        look_alikes={
            "asymmetric_friction": "at one speed the viscous difference is a dry one",
            "torque_offset": "while the motor moves both are nearly a constant torque",
        },
    ),
)
