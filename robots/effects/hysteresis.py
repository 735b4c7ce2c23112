# SPDX-License-Identifier: BSD-3-Clause
"""A transmission that remembers: friction inside belts, cables and teeth (Dahl's model)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, Memory, smooth_sign

DEFLECTIONS = (0.001, 0.002, 0.004, 0.008, 0.015, 0.03)  # [rad]
WIDTH = 1e-3  # [rad/s] over which the sign of the deflection's rate is rounded; much slower, z would pass 1


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """T z [N m]."""
    return p["torque"] * s.memory


def rate(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """dz/dt = (rate / delta_0) (1 - z sign(rate)) [1/s], with the rate of the deflection."""
    v = s.deflection_rate
    return v / p["deflection"] * (1.0 - s.memory * smooth_sign(v, WIDTH))


EFFECT = JointTorque(
    id="hysteresis",
    side="spring",
    law=law,
    memory=Memory(rate=rate, noise=1e-3, spread=0.5),
    parameters=(
        EffectParameter("torque", "N m", start=0.5, prior_sigma=100.0, sign="+"),
        EffectParameter(
            "deflection", "rad", start=0.005, prior_sigma=0.015, sign="+", logarithmic=True, grid=DEFLECTIONS
        ),
    ),
    example={"torque": 2.0, "deflection": 0.005},
    card=Card(
        title="hysteresis of the transmission",
        law="tau_c = K (q_link - q_motor) + D (v_link - v_motor) + T z, dz/dt = (rate / delta_0) (1 - z sign(rate)), "
        "rate = v_link - v_motor, T = torque, delta_0 = deflection",
        explanation="Strands, teeth and fibres slide on each other as the spring deflects: it takes another way back "
        "than forth. z runs from -1 to 1 and follows the deflection over the distance delta_0.",
        source="Dahl (1968), A solid friction model, Aerospace Corporation; Ho, Kisner (BioRob), sec. 4.2 and fig. 4: "
        "all springs show hysteresis",
        typical="1 to 10 % of the largest torque of the spring",
        excitation="deflections of several sizes that turn round half way, slowly as well as fast",
        look_alikes={
            "motor_stribeck": "both act just after a reversal",
            "backlash": "both lag behind after a reversal; hysteresis takes energy, a gap does not",
            "load_dependent_friction": "both take energy out of every change of the load",
            "spring_cubic": "both change the apparent stiffness with the size of the deflection",
            "encoder_hysteresis": "both read otherwise on the way back; play of a sensor does so without load, too",
            "link_coulomb": "while the motor stands the deflection turns round with the link",
        },
    ),
)
