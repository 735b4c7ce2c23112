# SPDX-License-Identifier: BSD-3-Clause
"""Weight that balancing springs do not quite carry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """A cos(q_link) + B sin(q_link) [N m]."""
    return p["cos"] * np.cos(s.q_link) + p["sin"] * np.sin(s.q_link)


EFFECT = JointTorque(
    id="gravity_imbalance",
    turning=True,
    side="link",
    law=law,
    bends="smoothly",
    parameters=(
        EffectParameter("cos", "N m", start=0.0, prior_sigma=500.0),
        EffectParameter("sin", "N m", start=0.0, prior_sigma=500.0),
    ),
    example={"cos": 1.0, "sin": 3.0},
    card=Card(
        title="weight that is not balanced",
        law="M a_link + c + g + tau_c = ... + A cos(q_link) + B sin(q_link), with A = cos, B = sin",
        explanation="Springs or counterweights carry more or less than the weight, or the model knows the masses "
        "badly: a torque remains that turns with the angle of the joint.",
        source="Schuethe et al. (2016), sec. 3.2: springs counteract gravity, tau_g of eq. (1) is neglected; Ho, "
        "Kisner (BioRob), eq. (11)",
        typical="5 to 20 % of the weight's largest torque; exact for one joint whose axis is level",
        excitation="slow motion and rests over the whole range of the joint",
        look_alikes={
            "parallel_spring": "near one position the weight changes with the angle as a spring's torque does",
            "torque_offset": "near one position the weight is a constant torque",
            "asymmetric_friction": "near one position the weight is a constant torque, as friction is while moving",
            "cogging": "at order 1 both are a sine of the position",
            "inertia_error": "where gravity acts, a wrong first moment comes with a wrong inertia",
            "encoder_offset": "weight in another posture differs by a sine of the angle",
            "link_mass": "at one joint a wrong first moment is a weight that turns with the angle",
            "gravity_direction": "at one joint a turned weight is a sine of the angle",
        },
    ),
)
