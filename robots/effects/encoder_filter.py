# SPDX-License-Identifier: BSD-3-Clause
"""An encoder reading that a filter has smoothed."""

from __future__ import annotations

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading

EFFECT = SmoothedReading(
    id="encoder_filter",
    owners=("joint", "robot"),
    variance="variance",
    parameters=(EffectParameter("variance", "s^2", start=5e-5, prior_sigma=1e-3, sign="+", logarithmic=True),),
    example={"variance": 1e-4},
    card=Card(
        title="encoder smoothed by a filter",
        law="reading(t) = q_motor(t) + variance/2 q_motor''(t), with the variance of the filter's weights over time: "
        "T^2 for a low-pass of first order with time constant T, W^2/12 for a mean over a time W",
        explanation="Drivers smooth positions before they give them out: fast motion reads smaller than it is, and "
        "inertias come out wrong. A filter also makes readings late by the mean age of its weights (T, or W/2): that "
        "part is encoder_delay or, for all joints, command_delay.",
        source="Oppenheim, Schafer, Discrete-Time Signal Processing, on group delay; the cumulants of the impulse "
        "response are the Taylor series of the logarithm of its transform",
        typical="time constants of 1 to 20 ms",
        excitation="motion of several frequencies, fast oscillation among them",
        look_alikes={
            "encoder_delay": "a filter of first order is late, too; the variance is what no delay explains",
            "command_delay": "a filter of first order is late, too; the variance is what no delay explains",
            "encoder_scale": "in motion of one frequency both change the amplitude alone",
            "inertia_error": "in motion of one frequency a smaller amplitude is a larger inertia",
            "joint_elasticity": "a soft spring makes the link move more than the motor reads, with the same law below "
            "its resonance",
        },
    ),
)
