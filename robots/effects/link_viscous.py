# SPDX-License-Identifier: BSD-3-Clause
"""Viscous friction of a link."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """-d v_link [N m]."""
    return -p["coefficient"] * s.v_link


EFFECT = JointTorque(
    id="link_viscous",
    side="link",
    law=law,
    bends="never",
    parameters=(EffectParameter("coefficient", "N m s/rad", start=0.1, prior_sigma=50.0, sign="+"),),
    example={"coefficient": 1.0},
    card=Card(
        title="viscous friction on the link side",
        law="M a_link + c + g + tau_c = ... - d v_link, with d = coefficient",
        explanation="The bearing of the joint, cables across it and the air resist in proportion to the link's speed; "
        "it damps the link against the world, not against its motor.",
        source="Ho, Kisner (BioRob), eq. (7), matrix D; Schuethe et al. (2016), eq. (1), tau_fl, found close to zero",
        typical="less than the viscous friction of the motor on the link side",
        excitation="oscillation of the link while the motor stands, and fast motion",
        look_alikes={
            "motor_viscous": "with a stiff spring both sides move alike",
            "link_coulomb": "within a narrow range of speeds a constant and a proportional torque agree",
            "coriolis": "within a narrow range of speeds any drag looks alike",
        },
    ),
)
