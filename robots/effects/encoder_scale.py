# SPDX-License-Identifier: BSD-3-Clause
"""An encoder that counts too much or too little: a wrong gear ratio, number of lines or unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect


def law(reading: Any, time: Any, p: Mapping[str, Any]) -> Any:
    """Scale error times angle [rad]."""
    return p["scale"] * reading


EFFECT = ReadingEffect(
    id="encoder_scale",
    law=law,
    parameters=(EffectParameter("scale", "1", start=0.0, prior_sigma=0.5),),
    example={"scale": 0.02},
    card=Card(
        title="wrong gear ratio or encoder scale",
        law="reading = (1 + scale) q_motor + zero",
        explanation="The number that turns counts into the joint's angle is wrong: another gear ratio than the file "
        "says, another number of lines. Every angle and every speed of the joint is off by the same share, which gyros "
        "contradict. Correct the number; this is no physics of the robot.",
        source="Hollerbach, Khalil, Gautier (2016), Springer Handbook of Robotics, ch. 6: gains of joint sensors",
        typical="1 to 20 % where a number is mistaken, 0.01 % where a belt wears",
        excitation="motion of the joint with a gyro on a body that it turns",
        look_alikes={
            "encoder_filter": "in motion of one frequency both change the amplitude alone",
            "encoder_eccentricity": "over a small part of a turn the slope of its error is a scale",
            "gyro_scale": "the same share of all joints that a gyro sees is a scale of the gyro",
        },
    ),
)
