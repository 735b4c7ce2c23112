# SPDX-License-Identifier: BSD-3-Clause
"""An encoder disk that does not run true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView


def law(reading: Any, time: Any, p: Mapping[str, Any]) -> Any:
    """A cos(N q_motor) + B sin(N q_motor) [rad]."""
    phase = p["order"] * reading
    return p["cos"] * np.cos(phase) + p["sin"] * np.sin(phase)


@dataclass(frozen=True, kw_only=True)
class EncoderEccentricity(ReadingEffect):
    """The encoder turns once with the joint, or once with the motor."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With the gear's ratio among the orders."""
        gear = robot.constants.get("motor.gear")
        if gear is None:
            return self.parameters
        cos, sin, order = self.parameters
        return cos, sin, replace(order, grid=tuple(sorted({*order.grid, gear})))


EFFECT = EncoderEccentricity(
    id="encoder_eccentricity",
    law=law,
    parameters=(
        EffectParameter("cos", "rad", start=0.0, prior_sigma=0.1),
        EffectParameter("sin", "rad", start=0.0, prior_sigma=0.1),
        EffectParameter("order", "1", start=1.0, prior_sigma=0.01, sign="+", logarithmic=True, grid=(1.0,)),
    ),
    example={"cos": 0.002, "sin": 0.003, "order": 1.0},
    card=Card(
        title="eccentric encoder",
        law="reading = q_motor + A cos(N q_motor) + B sin(N q_motor), with A = cos, B = sin, N = order: 1 for an "
        "encoder at the joint, the gear's ratio for one at the motor",
        explanation="The disk of the encoder is not centred on its shaft: the reading is ahead over one half of a turn "
        "and behind over the other.",
        source="HEIDENHAIN, Angle Encoders, section on measuring accuracy: eccentricity of the graduation to the "
        "bearing",
        typical="1e-4 to 5e-3 rad",
        excitation="motion over a good part of a turn of the encoder, with a gyro that sees the joint",
        look_alikes={
            "cogging": "an error of the reading that repeats with the position bends the estimated motion",
            "encoder_scale": "over a small part of a turn the slope of the error is a scale",
            "gyro_scale": "over a small part of a turn the slope of the error is a scale between encoder and gyro",
        },
    ),
)
