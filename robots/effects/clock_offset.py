# SPDX-License-Identifier: BSD-3-Clause
"""A clock that is ahead or behind."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.time_shift import TimeShift

Array = NDArray[np.float64]


def late(stamps: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """The same for all samples [s]."""
    ones = np.ones_like(stamps)
    return p["offset"] * ones, {"offset": ones}


EFFECT = TimeShift(
    id="clock_offset",
    owners=("gyro", "robot"),
    late=late,
    sensors="all",
    parameters=(EffectParameter("offset", "s", start=0.0, prior_sigma=0.5),),
    example={"offset": 3e-3},
    card=Card(
        title="offset of a clock",
        law="a sample with stamp t was taken at t - offset; owner robot: all sensors against the commands",
        explanation="Two computers stamp with two clocks. One is ahead of the other, so that stamps of the same "
        "instant differ, either way.",
        source="Furgale, Rehder, Siegwart (2013), Unified temporal and spatial calibration for multi-sensor systems, "
        "IROS; Kelly, Sukhatme (2014), in Experimental Robotics, Springer",
        typical="0.1 to 20 ms between computers that are synchronised, anything between others",
        excitation="fast oscillation of the body that carries the sensor",
        look_alikes={
            "gyro_delay": "the same law; only the sign and the other sensors on that clock tell them apart",
            "encoder_delay": "only differences in time show",
            "command_delay": "stamps that are late against the commands look like a late command",
            "motor_lag": "stamps that are late against the commands look like a late command",
            "clock_drift": "in a short recording a drift is mostly its mean",
        },
    ),
)
