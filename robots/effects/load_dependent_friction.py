# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a gear that grows with the torque it passes on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, smooth_abs

WIDTH = 0.05  # [N m] load below which the corner of the absolute value is rounded


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-mu_L |tau_c| tanh(k v_motor) [N m]."""
    return -p["coefficient"] * smooth_abs(s.tau_spring, WIDTH) * np.tanh(s.sharpness * s.v_motor)


EFFECT = JointTorque(
    id="load_dependent_friction",
    side="motor",
    law=law,
    bends="smoothly",
    parameters=(EffectParameter("coefficient", "1", start=0.02, prior_sigma=5.0, sign="+"),),
    example={"coefficient": 0.1},
    card=Card(
        title="friction that grows with the load",
        law="b a_motor = ... - mu_L |tau_c| tanh(k v_motor), with mu_L = coefficient, tau_c the torque of the spring; "
        "of a rigid joint the weight that it carries; the tip of |x| is rounded, x tanh(x / w) with w = 0.05 N m",
        explanation="The torque that a gear or a belt passes on presses its surfaces together, so that friction rises "
        "with it. What arrives is then a fixed share less than what is sent.",
        source="Ho, Kisner (BioRob), eq. (12), (14): stiction as a function of the stress in the joint; Bittencourt, "
        "Gunnarsson (2012), Static friction in a robot joint, J. Dynamic Systems, Measurement, and Control 134(5)",
        typical="0.02 to 0.2 for gears",
        excitation="motion at one speed under different loads: with and against gravity, braking and accelerating",
        look_alikes={
            "motor_stribeck": "at a reversal speed is low and load is high at once",
            "hysteresis": "both take energy out of every change of the load",
            "torque_constant_error": "while a joint moves one way, friction of its load is a share of its torque",
            "weight_dependent_friction": "in slow motion the spring transmits the weight and nothing else",
        },
    ),
)
