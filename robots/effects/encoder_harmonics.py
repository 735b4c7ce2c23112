# SPDX-License-Identifier: BSD-3-Clause
"""An encoder whose error repeats several times per turn: a higher harmonic."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointscope.robots.effect_kinds.effect import LINK_SIDE, Card, EffectParameter
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

ORDERS = (3.0, 4.0, 5.0, 6.0, 8.0)
OF_MOTOR = (2.0, 3.0, 4.0)  # times the gear's ratio


def law(reading: Any, time: Any, p: Mapping[str, Any]) -> Any:
    """A cos(N q) + B sin(N q) [rad]."""
    phase = p["order"] * reading
    return p["cos"] * np.cos(phase) + p["sin"] * np.sin(phase)


@dataclass(frozen=True, kw_only=True)
class EncoderHarmonics(ReadingEffect):
    """Orders that an encoder of the owner may have and `encoder_eccentricity` lacks there."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """An encoder that is not on the link may show each turn twice, or sit on the motor."""
        if owner.endswith(LINK_SIDE):
            return self.parameters
        cos, sin, order = self.parameters
        gear = robot.constants.get("motor.gear")
        own = () if gear is None else tuple(times * gear for times in OF_MOTOR)
        return cos, sin, replace(order, grid=tuple(sorted({2.0, *order.grid, *own})))


EFFECT = EncoderHarmonics(
    id="encoder_harmonics",
    law=law,
    turning=True,
    owners=("joint", "joint_link"),
    parameters=(
        EffectParameter("cos", "rad", start=0.0, prior_sigma=0.1),
        EffectParameter("sin", "rad", start=0.0, prior_sigma=0.1),
        EffectParameter("order", "1", start=4.0, prior_sigma=0.04, sign="+", logarithmic=True, grid=ORDERS, weak=True),
    ),
    example={"cos": 0.002, "sin": 0.003, "order": 4.0},
    card=Card(
        title="higher harmonics of an encoder",
        law="reading = q_motor + A cos(N q_motor) + B sin(N q_motor), with A = cos, B = sin, N = order: periods per "
        "turn of the joint; q_link for an encoder on the link, JOINT.link",
        explanation="What is read are the sine and the cosine of N times the angle: teeth of a gear rim, pole pairs of "
        "a magnet, lines of a resolver. Offsets of the two signals show once per period, a magnet that saturates or "
        "iron nearby at the third and fourth harmonic. Once and twice per turn is encoder_eccentricity.",
        source="Hanselman (1990), Resolver signal requirements for high accuracy resolver-to-digital conversion, IEEE "
        "Trans. Industrial Electronics 37(6); Ho, Kisner (BioRob), app. A.2: nonlinear Hall sensors",
        typical="1e-4 to 1e-2 rad",
        excitation="motion over several periods, with another sensor that sees the joint",
        look_alikes={
            "encoder_eccentricity": "over a part of a turn low harmonics bend the reading alike",
            "cogging": "an error of the reading that repeats with the position bends the estimated motion",
        },
    ),
)
