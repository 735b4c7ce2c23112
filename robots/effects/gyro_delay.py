# SPDX-License-Identifier: BSD-3-Clause
"""A gyro sample that is older than its stamp."""

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
    return p["delay"] * ones, {"delay": ones}


EFFECT = TimeShift(
    id="gyro_delay",
    owners=("gyro",),
    late=late,
    sensors="gyro",
    parameters=(EffectParameter("delay", "s", start=1e-3, prior_sigma=0.5, sign="+"),),
    example={"delay": 4e-3},
    card=Card(
        title="gyro sample older than its stamp",
        law="reading(t) = omega(t - delay) + bias",
        explanation="The filter inside a gyroscope and the bus take their time before the sample gets its stamp. "
        "Unlike an offset of its clock, a delay is never negative.",
        source="Furgale, Rehder, Siegwart (2013), Unified temporal and spatial calibration for multi-sensor systems, "
        "IROS; data sheets give the delay of the internal low-pass filter",
        typical="1 to 10 ms",
        excitation="fast oscillation of the body that carries the gyro",
        look_alikes={
            "clock_offset": "the same law; only the sign and the other sensors on that clock tell them apart",
            "encoder_delay": "only the difference in time between encoder and gyro shows, but for the command",
            "clock_drift": "in a short recording a drift is mostly its mean",
            "bearing_flexibility": "far below a resonance, tilting shifts the rate in phase",
        },
    ),
)
