# SPDX-License-Identifier: BSD-3-Clause
"""Play of a gear: a spring that acts only beyond a gap."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, loosened


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """K (dz(deflection, g) - deflection) - D rate within the gap [N m], corners rounded; exactly zero at g = 0."""
    return loosened(s, p["half_gap"])


EFFECT = JointTorque(
    id="backlash",
    side="spring",
    law=law,
    gap=("half_gap",),
    parameters=(EffectParameter("half_gap", "rad", start=0.005, prior_sigma=0.015, sign="+", logarithmic=True),),
    example={"half_gap": 0.01},
    card=Card(
        title="play of the transmission",
        law="tau_c = K dz(q_link - q_motor, g) + D (v_link - v_motor) beyond the gap, 0 within it; dz(x, g) = x - g "
        "above g, x + g below -g; g = half_gap; a curve of the spring's own starts beyond the gap, too",
        explanation="Teeth do not fill each other's gaps: after a reversal the motor turns through the gap before the "
        "link feels it.",
        source="Nordin, Gutman (2002), Controlling mechanical systems with backlash - a survey, Automatica 38(10); "
        "Neubauer et al. (2015), eq. (18), as a jump with the sign of the torque",
        typical="0.0003 to 0.02 rad at the joint",
        excitation="reversals of the torque under little load, many of them",
        look_alikes={
            "spring_cubic": "both make the spring soft at small and hard at large deflections",
            "hysteresis": "both lag behind after a reversal; hysteresis takes energy, a gap does not",
            "encoder_hysteresis": "both lag behind after a reversal; play of a sensor moves nothing but its reading",
            "spring_slack": "the same where both ropes are slack by as much, or where zeros of encoders are unknown",
        },
    ),
)
