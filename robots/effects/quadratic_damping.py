# SPDX-License-Identifier: BSD-3-Clause
"""Drag that grows with the square of speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-c v_motor |v_motor| [N m]."""
    return -p["coefficient"] * s.v_motor * s.v_motor * np.sign(np.real(s.v_motor))


EFFECT = JointTorque(
    id="quadratic_damping",
    side="motor",
    law=law,
    bends="smoothly",
    parameters=(EffectParameter("coefficient", "N m s^2/rad^2", start=0.1, prior_sigma=50.0, sign="+"),),
    example={"coefficient": 1.0},
    card=Card(
        title="drag that grows with the square of speed",
        law="b a_motor = ... - c v_motor |v_motor|, with c = coefficient",
        explanation="Air, water, or oil that gears and fans churn resists with the square of speed once its flow is "
        "turbulent. A model with viscous friction alone has too much of it at low speed and too little at high speed.",
        source="Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, sec. 6.4, quadratic damping; "
        "Seetharaman, Kahraman (2009), Load-independent spin power losses of a spur gear pair, J. Tribology 131(2)",
        typical="next to nothing in arms in air; most of the drag of arms under water and of fast gears in oil",
        excitation="fast motion in both directions at several speeds",
        look_alikes={
            "motor_viscous": "within a narrow range of speeds any drag looks alike",
            "motor_stribeck": "friction that is too large at low speed beside a viscous one that is too small",
        },
    ),
)
