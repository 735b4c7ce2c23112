# SPDX-License-Identifier: BSD-3-Clause
"""A gyro whose bias changes while it warms up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.parts.sensors import AXES


def law(reading: Any, time: Any, p: Mapping[str, Any]) -> Any:
    """Drift times time for each axis [rad/s]."""
    return np.asarray(time)[:, None] * np.stack([p[axis] for axis in AXES])


EFFECT = ReadingEffect(
    id="gyro_bias_drift",
    owners=("gyro",),
    law=law,
    parameters=tuple(EffectParameter(axis, "rad/s^2", start=0.0, prior_sigma=0.01) for axis in AXES),
    example={"x": 4e-4, "y": -3e-4, "z": 2e-4},
    card=Card(
        title="drift of a gyro's bias",
        law="reading = omega + bias + d t, with d = x, y, z for the three axes of the sensor, t since the start of the "
        "recording",
        explanation="The bias of a gyroscope follows its temperature; while it warms up, it drifts almost linearly.",
        source="Titterton, Weston, Strapdown Inertial Navigation Technology, chapter on gyroscopes; Schuethe et al. "
        "(2016), sec. 4.1, takes the biases as constant",
        typical="1e-6 to 1e-4 rad/s^2",
        excitation="a long recording; rests at its start and its end show it at once",
        look_alikes={
            "gyro_scale": "a motion that gets faster towards the end makes an error of scale grow with time",
            "clock_drift": "both grow with time, but a drift of the clock vanishes at rest",
        },
    ),
)
