# SPDX-License-Identifier: BSD-3-Clause
"""A gyro that reads too much or too little."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.parts.sensors import AXES


def law(reading: Any, time: Any, p: Mapping[str, Any]) -> Any:
    """Scale error times rate for each axis [rad/s]."""
    return reading * np.stack([p[axis] for axis in AXES])


EFFECT = ReadingEffect(
    id="gyro_scale",
    owners=("gyro",),
    law=law,
    parameters=tuple(EffectParameter(axis, "1", start=0.0, prior_sigma=0.5) for axis in AXES),
    example={"x": 0.02, "y": -0.015, "z": 0.01},
    card=Card(
        title="scale error of a gyro",
        law="reading = (1 + s) omega + bias, with s = x, y, z for the three axes of the sensor",
        explanation="Each axis of a gyroscope has its own gain, known to a few percent and changing with temperature.",
        source="Titterton, Weston, Strapdown Inertial Navigation Technology, chapter on gyroscopes: scale-factor "
        "error; IEEE Std 1431-2004",
        typical="0.1 to 3 % for MEMS gyros",
        excitation="rotation about all three axes of the sensor; the scale of an axis that rests stays open",
        look_alikes={
            "encoder_eccentricity": "over a small part of a turn the slope of the error is a scale between encoder and "
            "gyro",
            "encoder_scale": "the same share of all joints that a gyro sees is a scale of the gyro",
            "bearing_flexibility": "a small part of the tilt turns with the body's own rate",
            "gyro_bias_drift": "a motion that gets faster towards the end makes an error of scale grow with time",
        },
    ),
)
