# SPDX-License-Identifier: BSD-3-Clause
"""Torque ripple of a motor or a gear."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

ORDERS = tuple(float(n) for n in (*range(1, 21), *range(22, 61, 2), *range(64, 201, 4)))
TURNS = (1.0, 2.0, 4.0)  # orders of the motor itself: eccentricity, two poles, four poles


def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
    """A cos(N q_motor) + B sin(N q_motor) [N m]."""
    phase = p["order"] * s.q_motor
    return p["cos"] * np.cos(phase) + p["sin"] * np.sin(phase)


@dataclass(frozen=True, kw_only=True)
class Cogging(JointTorque):
    """A ripple whose orders are likely multiples of the gear's ratio."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With the orders of one turn of the motor added to the grid."""
        gear = robot.constants.get("motor.gear")
        if gear is None:
            return self.parameters
        cos, sin, order = self.parameters
        grid = sorted({*order.grid, *(turn * gear for turn in TURNS)})
        return cos, sin, replace(order, start=gear, grid=tuple(grid))


EFFECT = Cogging(
    id="cogging",
    side="motor",
    law=law,
    parameters=(
        EffectParameter("cos", "N m", start=0.0, prior_sigma=100.0),
        EffectParameter("sin", "N m", start=0.0, prior_sigma=100.0),
        EffectParameter("order", "1", start=12.0, prior_sigma=36.0, sign="+", logarithmic=True, grid=ORDERS),
    ),
    example={"cos": 0.6, "sin": 0.8, "order": 12.0},
    card=Card(
        title="torque ripple of motor or gear",
        law="b a_motor = ... + A cos(N q_motor) + B sin(N q_motor), with A = cos, B = sin, N = order: periods per turn "
        "of the joint",
        explanation="Magnets snap to the teeth of the iron, and teeth of gears and belts mesh: the torque has a ripple "
        "that repeats with the position of the motor. The grid of orders is coarse: a diagnosis also scans the "
        "spectrum of the missing torque over the position.",
        source="Hanselman, Brushless Permanent Magnet Motor Design; Armstrong-Helouvry, Dupont, Canudas de Wit (1994), "
        "Automatica 30(7), on friction that depends on position",
        typical="1 to 5 % of the rated torque, at multiples of the gear's ratio or of its numbers of teeth",
        excitation="slow motion over more than one period of the ripple, better over the whole range",
        look_alikes={
            "encoder_eccentricity": "an error of the reading that repeats with the position bends the estimated motion",
            "encoder_harmonics": "an error of the reading that repeats with the position bends the estimated motion",
            "gravity_imbalance": "at order 1 both are a sine of the position",
        },
    ),
)
