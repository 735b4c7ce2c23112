# SPDX-License-Identifier: BSD-3-Clause
"""An encoder whose zero is not where the model has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect


def law(reading: Any, time: Any, p: Mapping[str, Any]) -> Any:
    """A constant [rad]."""
    return p["offset"] * np.ones_like(reading)


EFFECT = ReadingEffect(
    id="encoder_offset",
    aliases=("joint_offset",),
    turning=True,
    owners=("joint", "joint_link"),
    law=law,
    parameters=(EffectParameter("offset", "rad", start=0.0, prior_sigma=1.0),),
    example={"offset": 0.05},
    card=Card(
        title="wrong zero of an encoder",
        law="reading = q_motor + zero + offset; q_link for an encoder on the link, JOINT.link",
        explanation="Where the encoder reads zero the joint is somewhere else: it was mounted or homed wrongly. The "
        "weight of the links and their coupling then belong to another posture than the model thinks. Correct the "
        "zero; this is no physics of the robot.",
        source="Hollerbach, Khalil, Gautier (2016), Springer Handbook of Robotics, ch. 6: offsets of joint sensors",
        typical="0.005 to 0.1 rad",
        excitation="slow motion of joints that carry weight, in several postures",
        look_alikes={
            "gravity_direction": "at a joint with a level axis a turned base and a turned zero are the same",
            "gravity_imbalance": "weight in another posture differs by a sine of the angle",
            "spring_slack": "slack of one rope moves the middle of the spring, as a wrong zero does",
            "axis_misalignment": "where axes are nearly parallel, a zero of one is a turn about the other",
        },
    ),
)
