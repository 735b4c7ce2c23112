# SPDX-License-Identifier: BSD-3-Clause
"""Viscous friction of a motor and its gear."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-d v_motor [N m]."""
    return -p["coefficient"] * s.v_motor


EFFECT = JointTorque(
    id="motor_viscous",
    side="motor",
    law=law,
    bends="never",
    parameters=(EffectParameter("coefficient", "N m s/rad", start=0.5, prior_sigma=50.0, sign="+"),),
    example={"coefficient": 2.0},
    card=Card(
        title="viscous friction on the motor side",
        law="b a_motor = ... - d v_motor, with d = coefficient",
        explanation="Grease in gear and bearings resists in proportion to the speed of the motor. The same coefficient "
        "on all joints is nothing but a larger motor.k_mi.",
        source="Armstrong-Helouvry, Dupont, Canudas de Wit (1994), A survey of models, analysis tools and compensation "
        "methods for the control of machines with friction, Automatica 30(7); neglected in Schuethe et al. (2016), "
        "sec. 3.2",
        typical="1 to 10 % of the back-EMF constant on the link side",
        excitation="fast motion in both directions at several speeds",
        look_alikes={
            "link_viscous": "with a stiff spring both sides move alike",
            "quadratic_damping": "within a narrow range of speeds any drag looks alike",
            "motor_stribeck": "at speeds below the Stribeck velocity both change friction with speed",
        },
    ),
)
