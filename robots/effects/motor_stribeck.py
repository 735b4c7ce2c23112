# SPDX-License-Identifier: BSD-3-Clause
"""Friction that falls as the motor starts to move."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque

VELOCITIES = (0.02, 0.035, 0.06, 0.1, 0.17, 0.3, 0.5)  # [rad/s]


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-s exp(-(v_motor / v_s)^2) tanh(k v_motor) [N m]."""
    ratio = s.v_motor / p["velocity"]
    return -p["torque"] * np.exp(-ratio * ratio) * np.tanh(s.sharpness * s.v_motor)


EFFECT = JointTorque(
    id="motor_stribeck",
    side="motor",
    law=law,
    parameters=(
        EffectParameter("torque", "N m", start=0.5, prior_sigma=100.0, sign="+"),
        EffectParameter("velocity", "rad/s", start=0.1, prior_sigma=0.3, sign="+", logarithmic=True, grid=VELOCITIES),
    ),
    example={"torque": 2.0, "velocity": 0.1},
    card=Card(
        title="Stribeck friction on the motor side",
        law="b a_motor = ... - s exp(-(v_motor / v_s)^2) tanh(k v_motor), with s = torque, v_s = velocity",
        explanation="At rest the surfaces touch and friction is highest; with speed they draw a film of lubricant "
        "between them and friction falls to the Coulomb value. It makes slow motion jerky.",
        source="Canudas de Wit, Olsson, Astrom, Lischinsky (1995), A new model for control of systems with friction, "
        "IEEE Trans. Automatic Control 40(3); Olsson et al. (1998), Friction models and friction compensation",
        typical="10 to 100 % of the Coulomb torque, at a hundredth to a tenth of the largest speed",
        excitation="many slow reversals and creeping motion below the Stribeck velocity",
        look_alikes={
            "hysteresis": "both act just after a reversal",
            "load_dependent_friction": "at a reversal speed is low and load is high at once",
            "motor_viscous": "within one range of speeds a falling curve is a negative viscous coefficient",
            "quadratic_damping": "beside viscous friction both bend the curve of friction over speed",
            "pwm_deadband": "both take torque away where the command is small",
        },
    ),
)
