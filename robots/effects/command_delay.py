# SPDX-License-Identifier: BSD-3-Clause
"""A command that acts later than its stamp says."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.effect import Card, EffectParameter

Array = NDArray[np.float64]


def law(edges: Array, commands: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """Mean over each step of u(t - delay); before the first step the command was the first one.

    The mean is the difference of the integral of u between the moved edges, so it is exact for any delay; its
    derivative by the delay is minus the difference of u just before the moved edges.
    """
    delay, h = p["delay"], np.diff(edges)
    moved = edges - delay
    step = np.clip(np.searchsorted(edges, moved, side="left") - 1, 0, len(commands) - 1)
    held = commands[step]
    by_delay = -np.diff(held) / h
    if delay == 0.0:
        return commands.copy(), {"delay": by_delay}
    integral = np.append(0.0, np.cumsum(commands * h))[step] + held * (moved - edges[step])
    return np.diff(integral) / h, {"delay": by_delay}


EFFECT = CommandEffect(
    id="command_delay",
    owners=("joint", "robot"),
    law=law,
    parameters=(EffectParameter("delay", "s", start=1e-3, prior_sigma=0.5, sign="+"),),
    example={"delay": 3e-3},
    card=Card(
        title="command acts later than stamped",
        law="u_acting(t) = u(t - delay)",
        explanation="Bus, motor controller and PWM cycle take their time; the command acts some milliseconds after the "
        "computer has logged it.",
        source="Astrom, Wittenmark, Computer-Controlled Systems: Theory and Design, on computational and transport "
        "delays",
        typical="one or two control periods, 1 to 10 ms",
        excitation="steps and chirps of the command",
        look_alikes={
            "encoder_filter": "smoothed positions are late, too; the variance is what no delay explains",
            "motor_lag": "they agree to first order; only steps of the command at a high rate tell them apart",
            "encoder_delay": "with the encoder late, motion seems to lag behind the command",
            "clock_offset": "stamps that are late against the commands look like a late command",
            "integration_error": "Euler's rule shifts the motion by half a step",
        },
    ),
)
