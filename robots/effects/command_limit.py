# SPDX-License-Identifier: BSD-3-Clause
"""Drives that give no more than a limit, whatever is commanded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.command_effect import USUAL_VOLTAGE, CommandEffect
from jointscope.robots.effect_kinds.effect import Card, EffectParameter

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

Array = NDArray[np.float64]
SHARES = (0.15, 0.25, 0.4, 0.6, 0.85)  # of the full command, at which a diagnosis looks for a limit
OVER_FRICTION = 20.0  # times the dry friction is a full command where nothing else says what that is
EXAMPLE = 0.15  # of a full duty cycle


def law(edges: Array, commands: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """U - lost (u - clip(u, -limit, limit)); all of the excess is lost for 1."""
    excess = commands - np.clip(commands, -p["limit"], p["limit"])
    by_limit = p["lost"] * np.sign(excess)
    return commands - p["lost"] * excess, {"lost": -excess, "limit": by_limit}


@dataclass(frozen=True, kw_only=True)
class CommandLimit(CommandEffect):
    """A limit in the unit of the robot's command."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With unit and size of the robot's command."""
        lost, limit = self.parameters
        full, unit = _full_command(robot, owner), robot.command.unit
        grid = tuple(share * full for share in SHARES)
        sized = replace(limit, start=limit.start * full, prior_sigma=limit.prior_sigma * full, grid=grid)
        return lost, replace(sized, unit="1" if unit == "duty" else unit)


def _full_command(robot: RobotView, owner: str) -> float:
    """The most that a drive of this kind is commanded, as far as the robot file tells."""
    unit = robot.command.unit
    if unit == "duty":
        return 1.0
    if unit == "V":
        return robot.constants.get("motor.supply_voltage", USUAL_VOLTAGE)
    allowed = float(robot.tree.effort_limits[robot.joints.index(owner)]) if owner in robot.joints else 0.0
    if unit == "N m" and 0.0 < allowed < np.inf:
        return allowed
    gain = robot.drive_gain
    per_unit = 1.0 if gain is None else robot.drive_parameter(owner, gain).value
    return OVER_FRICTION * robot.drive_parameter(owner, "coulomb_torque").value / per_unit


EFFECT = CommandLimit(
    id="command_limit",
    law=law,
    parameters=(
        EffectParameter("lost", "1", start=1.0, prior_sigma=0.3, sign="+", logarithmic=True),
        EffectParameter("limit", "1", start=0.9, prior_sigma=2.7, sign="+", logarithmic=True, grid=SHARES),
    ),
    example={"lost": 1.0, "limit": EXAMPLE},
    card=Card(
        title="drive that saturates",
        law="u_acting = u - lost (u - clip(u, -limit, limit)), with limit in the unit of the command",
        explanation="Current limits, thermal protection and the end of the supply cut large commands inside the drive, "
        "while the recording holds what was asked for. Inertia and friction seem larger, and the motion falls behind.",
        source="Astrom, Wittenmark, Computer-Controlled Systems: Theory and Design, on saturating actuators",
        typical="30 to 100 % of the largest command; all of what is beyond is lost",
        excitation="commands beyond the limit, in the fastest parts of a motion",
        look_alikes={"torque_constant_error": "where most of the command is beyond the limit, it is worth less"},
    ),
)
