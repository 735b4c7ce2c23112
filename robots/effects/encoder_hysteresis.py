# SPDX-License-Identifier: BSD-3-Clause
"""A sensor with a dead zone: what it reads depends on the way by which the angle was approached."""

from __future__ import annotations

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.lagging_reading import LaggingReading

EFFECT = LaggingReading(
    id="encoder_hysteresis",
    aliases=("sensor_dead_zone",),
    owners=("joint", "joint_link"),
    width="half_play",
    parameters=(EffectParameter("half_play", "rad", start=1e-3, prior_sigma=0.1, sign="+"),),
    example={"half_play": 2e-3},
    card=Card(
        title="play of a sensor",
        law="reading = clip(reading before, q_motor - h, q_motor + h) with h = half_play; q_link for an encoder on the "
        "link, JOINT.link",
        explanation="The magnet or the disc sits loose on its shaft, or the sensor's field follows late: the reading "
        "stands still until the joint has turned by 2 h, then lags by h. The same angle reads differently by the way "
        "it is approached, at any speed, and stays so at rest.",
        source="Ho, Kisner (BioRob), app. A.2: the joint sensor shows other dead zones by position and order of the "
        "approach; Visintin (1994), Differential Models of Hysteresis, sec. III.2: the play operator",
        typical="1e-4 to 1e-2 rad; twice that is the hysteresis that data sheets of Hall sensors give",
        excitation="many reversals, small as well as large, slow as well as fast, with another sensor that sees the "
        "joint",
        look_alikes={
            "backlash": "both lag behind after a reversal; a gap in the drive lets the link go, play of a sensor moves "
            "nothing but its reading",
            "hysteresis": "a spring that takes another way back than forth shows between the encoders, too; it needs "
            "load, play of a sensor does not",
            "encoder_delay": "both trail the motion; a delay by more the faster it is, play by the same at any speed",
            "encoder_eccentricity": "over few reversals an error by direction is one by position",
        },
    ),
)
