# SPDX-License-Identifier: BSD-3-Clause
"""An encoder disk that does not run true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointscope.robots.effect_kinds.effect import LINK_SIDE, Card, EffectParameter
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView


def law(reading: Any, time: Any, p: Mapping[str, Any]) -> Any:
    """A cos(N q) + B sin(N q) [rad], and the second harmonic of an encoder on the link."""
    phase = p.get("order", 1.0) * reading
    once = p["cos"] * np.cos(phase) + p["sin"] * np.sin(phase)
    return once + p.get("cos2", 0.0) * np.cos(2.0 * phase) + p.get("sin2", 0.0) * np.sin(2.0 * phase)


@dataclass(frozen=True, kw_only=True)
class EncoderEccentricity(ReadingEffect):
    """The encoder turns once with the joint, or once with the motor; one on the link may show each turn twice."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With the gear's ratio among the orders; an encoder on the link has two harmonics."""
        if owner.endswith(LINK_SIDE):
            cos, sin, _ = self.parameters
            return cos, sin, replace(cos, name="cos2"), replace(sin, name="sin2")
        gear = robot.constants.get("motor.gear")
        if gear is None:
            return self.parameters
        cos, sin, order = self.parameters
        return cos, sin, replace(order, grid=tuple(sorted({*order.grid, gear})))


EFFECT = EncoderEccentricity(
    id="encoder_eccentricity",
    aliases=("link_encoder_nonlinearity",),
    law=law,
    owners=("joint", "joint_link"),
    parameters=(
        EffectParameter("cos", "rad", start=0.0, prior_sigma=0.1),
        EffectParameter("sin", "rad", start=0.0, prior_sigma=0.1),
        EffectParameter("order", "1", start=1.0, prior_sigma=0.01, sign="+", logarithmic=True, grid=(1.0,), weak=True),
    ),
    example={"cos": 0.002, "sin": 0.003, "order": 1.0},
    card=Card(
        title="eccentric encoder",
        law="reading = q_motor + A cos(N q_motor) + B sin(N q_motor), with A = cos, B = sin, N = order: 1 for an "
        "encoder at the joint, the gear's ratio for one at the motor; an encoder on the link, JOINT.link, has "
        "A cos q + B sin q + A2 cos 2q + B2 sin 2q with A2 = cos2, B2 = sin2",
        explanation="The disk of the encoder is not centred on its shaft: the reading is ahead over one half of a turn "
        "and behind over the other. A Hall sensor whose magnet is off its axis or tilted does the same once and twice "
        "per turn.",
        source="HEIDENHAIN, Angle Encoders, section on measuring accuracy: eccentricity of the graduation to the "
        "bearing; Ho, Kisner (BioRob), app. A: nonlinear Hall sensors of the joints",
        typical="1e-4 to 5e-3 rad, 0.05 rad for Hall sensors",
        excitation="motion over a good part of a turn of the encoder, with a gyro that sees the joint",
        look_alikes={
            "encoder_harmonics": "over a part of a turn low harmonics bend the reading alike",
            "encoder_hysteresis": "over few reversals an error by direction is one by position",
            "cogging": "an error of the reading that repeats with the position bends the estimated motion",
            "encoder_scale": "over a small part of a turn the slope of the error is a scale",
            "gyro_scale": "over a small part of a turn the slope of the error is a scale between encoder and gyro",
        },
    ),
)
