# SPDX-License-Identifier: BSD-3-Clause
"""A clock that runs fast or slow."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.time_shift import TimeShift

Array = NDArray[np.float64]


def late(stamps: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """Growing with the time since the start of the recording [s]."""
    return p["drift"] * stamps, {"drift": stamps.copy()}


EFFECT = TimeShift(
    id="clock_drift",
    owners=("gyro", "robot"),
    late=late,
    sensors="all",
    parameters=(EffectParameter("drift", "s/s", start=0.0, prior_sigma=0.01),),
    example={"drift": 2e-4},
    card=Card(
        title="drift of a clock",
        law="a sample with stamp t was taken at t - drift t, t since the start of the recording; owner robot: all "
        "sensors against the commands",
        explanation="Quartz clocks of two devices run at slightly different speeds; without synchronisation the stamps "
        "drift apart during the recording.",
        source="Moon, Skelly, Towsley (1999), Estimation and removal of clock skew from network delay measurements, "
        "IEEE INFOCOM",
        typical="1e-6 to 1e-4 s/s; more where stamps are counted from a nominal sampling rate",
        excitation="a long recording with fast oscillation at its start and at its end",
        look_alikes={
            "clock_offset": "in a short recording a drift is mostly its mean",
            "gyro_delay": "in a short recording a drift is mostly its mean",
            "gyro_bias_drift": "both grow with time, but a drift of the clock vanishes at rest",
        },
    ),
)
