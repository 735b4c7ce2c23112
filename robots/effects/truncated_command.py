# SPDX-License-Identifier: BSD-3-Clause
"""Commands that a driver cut to whole numbers before they were recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.command_effect import CommandEffect, in_command_unit
from jointscope.robots.effect_kinds.effect import Card, EffectParameter

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

Array = NDArray[np.float64]
DUTY_START = 0.005  # [1] share of the full command: half of one percent in which drivers count
SHARE_OF_FRICTION = 0.05  # of the dry friction, where the command is a torque or a current
USUAL = 20.0  # times the start, within which what is lost is usual


def law(edges: Array, commands: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """The command, and what is lost on its side of zero."""
    sign = np.sign(commands)
    return commands + p["lost"] * sign, {"lost": sign}


@dataclass(frozen=True, kw_only=True)
class TruncatedCommand(CommandEffect):
    """What is lost, in the unit of the robot's command."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With unit and start of the robot's command."""
        (lost,) = self.parameters
        return (in_command_unit(lost, robot, owner, SHARE_OF_FRICTION),)


EFFECT = TruncatedCommand(
    id="truncated_command",
    law=law,
    parameters=(
        EffectParameter("lost", "1", start=DUTY_START, prior_sigma=USUAL * DUTY_START, sign="+", logarithmic=True),
    ),
    example={"lost": 0.01},
    card=Card(
        title="command cut to whole numbers",
        law="u_acting = u + sign(u) w, with w = lost in the unit of the command: half of a step",
        explanation="A driver that casts to whole numbers cuts toward zero: what acted was larger than what was "
        "recorded, by half a step on average. It looks like less dry friction wherever the command leads the motion.",
        source="ISO/IEC 9899:2018 (the C language), 6.3.1.4: a conversion to an integer discards the fraction; "
        "its mean over a step",
        typical="half of the step in which the recorded command comes; 1 to 5 % of its rms in coarse drivers",
        excitation="braking: there the command has turned round and the motion has not",
        look_alikes={
            "pwm_deadband": "the same with the other sign",
            "asymmetric_friction": "while accelerating, a larger command is less friction",
        },
    ),
)
