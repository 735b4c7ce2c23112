# SPDX-License-Identifier: BSD-3-Clause
"""Small commands that do nothing."""

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
DUTY_START = 0.02  # [1] share of the full command
SHARE_OF_FRICTION = 0.1  # of the dry friction, where the command is a torque or a current


def law(edges: Array, commands: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """sign(u) max(|u| - width, 0)."""
    width, sign, size = p["width"], np.sign(commands), np.abs(commands)
    beyond = size > width
    return np.where(beyond, commands - width * sign, 0.0), {"width": np.where(beyond, -sign, 0.0)}


@dataclass(frozen=True, kw_only=True)
class PwmDeadband(CommandEffect):
    """A width in the unit of the robot's command."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With unit and start of the robot's command."""
        (width,) = self.parameters
        return (in_command_unit(width, robot, owner, SHARE_OF_FRICTION),)


EFFECT = PwmDeadband(
    id="pwm_deadband",
    law=law,
    parameters=(
        EffectParameter("width", "1", start=DUTY_START, prior_sigma=3.0 * DUTY_START, sign="+", logarithmic=True),
    ),
    example={"width": 0.02},
    card=Card(
        title="dead band of the command",
        law="u_acting = sign(u) max(|u| - w, 0), with w = width in the unit of the command",
        explanation="Switches need time to change over and valves overlap: small commands do nothing, and larger ones "
        "lose the same amount. It looks like dry friction that turns round with the command instead of the motion.",
        source="Tao, Kokotovic (1996), Adaptive Control of Systems with Actuator and Sensor Nonlinearities, on dead "
        "zones",
        typical="0.5 to 5 % of the full command",
        excitation="braking: there the command has turned round and the motion has not",
        look_alikes={
            "motor_stribeck": "both take torque away where the command is small",
            "asymmetric_friction": "while accelerating, a lost command is more friction",
            "truncated_command": "the same with the other sign",
        },
    ),
)
