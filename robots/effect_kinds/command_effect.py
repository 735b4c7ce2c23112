# SPDX-License-Identifier: BSD-3-Clause
"""Effects between the logged command and the one that acts on the motor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Effect, EffectParameter

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

Array = NDArray[np.float64]
USUAL_VOLTAGE = 24.0  # [V] where the robot file names no supply
CommandLaw = Callable[[Array, Array, Mapping[str, float]], tuple[Array, dict[str, Array]]]


@dataclass(frozen=True, kw_only=True)
class CommandEffect(Effect):
    """A change of the command.

    Attributes:
        law: maps the edges of the steps, shape (m + 1,) [s], the logged commands of one joint, held over each step,
            shape (m,), and the parameters to the mean command that acts in each step, shape (m,), and its derivative
            by each parameter, by name, shape (m,) each. At the null values the command comes back unchanged and the
            derivatives are those from above.
    """

    law: CommandLaw = field(repr=False)


def in_command_unit(parameter: EffectParameter, robot: RobotView, owner: str, of_friction: float) -> EffectParameter:
    """A size of the command, known for duty cycles, in the unit of the robot's command.

    Args:
        parameter: with start and prior as shares of the full command.
        robot: which command it has.
        owner: the joint.
        of_friction: start as a share of the joint's dry friction, where the command is a torque or a current.
    """
    unit = robot.command.unit
    if unit == "duty":
        return parameter
    if unit == "V":
        start = parameter.start * robot.constants.get("motor.supply_voltage", USUAL_VOLTAGE)
    else:
        start = of_friction * robot.parameter(f"{owner}.coulomb_torque").value
    spread = parameter.prior_sigma / parameter.start
    return replace(parameter, unit=unit, start=start, prior_sigma=spread * start)
