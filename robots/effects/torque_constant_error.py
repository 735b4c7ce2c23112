# SPDX-License-Identifier: BSD-3-Clause
"""A drive that makes more or less torque of its command than the robot file says."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.effect import Card, EffectParameter

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

Array = NDArray[np.float64]


def law(edges: Array, commands: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """(1 + share) u."""
    return (1.0 + p["share"]) * commands, {"share": commands.copy()}


class TorqueConstantError(CommandEffect):
    """Only where the torque of a command is taken as known."""

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """Joints whose torque per command is taken as known; where it is a free parameter, that one says it all."""
        gain, owners = robot.drive_gain, super().owners_of(robot)
        return tuple(joint for joint in owners if gain is None or robot.drive_parameter(joint, gain).fixed)


EFFECT = TorqueConstantError(
    id="torque_constant_error",
    law=law,
    parameters=(EffectParameter("share", "1", start=0.0, prior_sigma=3.0),),
    example={"share": 0.1},
    card=Card(
        title="wrong torque constant",
        law="u_acting = (1 + share) u",
        explanation="The number that turns currents into torques is another one than the data sheet says: magnets that "
        "are warm or weak, a gear with losses, a driver with a scale of its own. Correct the number; this is no "
        "physics of the robot.",
        source="Gautier, Briot (2014), Global identification of joint drive gains and dynamic parameters of robots, "
        "Journal of Dynamic Systems, Measurement, and Control 136(5)",
        typical="3 to 15 % of a torque constant from a data sheet",
        excitation="motion under loads that are known: links whose masses the model knows, in several postures",
        look_alikes={
            "payload": "where rotors' inertias are not known, a load scales torques as a drive does",
            "load_scale": "known loads that are larger than said ask a drive for more torque",
            "link_mass": "with all inertias of a joint free, only their scale against known masses tells the constant",
            "command_limit": "where most of the command is beyond the limit, it is worth less",
            "load_dependent_friction": "while a joint moves one way, friction of its load is a share of its torque",
        },
    ),
)
