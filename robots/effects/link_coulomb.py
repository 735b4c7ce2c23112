# SPDX-License-Identifier: BSD-3-Clause
"""Dry friction of a link."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-mu tanh(k v_link) [N m]."""
    return -p["torque"] * np.tanh(s.sharpness * s.v_link)


EFFECT = JointTorque(
    id="link_coulomb",
    side="link",
    law=law,
    parameters=(EffectParameter("torque", "N m", start=0.1, prior_sigma=100.0, sign="+"),),
    example={"torque": 1.0},
    card=Card(
        title="Coulomb friction on the link side",
        law="M a_link + c + g + tau_c = ... - mu tanh(k v_link), with mu = torque",
        explanation="The bearing of the joint and seals resist the link with a torque that does not depend on its "
        "speed. It lets oscillations of the link stop rather than fade.",
        source="Schuethe et al. (2016), eq. (1), tau_fl, neglected there; eq. (12) prints the friction with the link's "
        "velocity",
        typical="less than the Coulomb torque of the motor on the link side",
        excitation="free oscillation of the link while the motor stands, down to small amplitudes",
        look_alikes={
            "link_viscous": "within a narrow range of speeds a constant and a proportional torque agree",
            "hysteresis": "while the motor stands the deflection turns round with the link",
        },
    ),
)
