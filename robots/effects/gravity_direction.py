# SPDX-License-Identifier: BSD-3-Clause
"""A base that does not stand as the model thinks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.structure import Structure

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView


@dataclass(frozen=True, kw_only=True)
class GravityDirection(Structure):
    """Acts only on robots whose joints carry weight and that feel gravity by their joints alone."""

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """The robot, if there is gravity in its model."""
        weighs = bool(np.any(robot.tree.gravity)) and not robot.accelerometers
        return super().owners_of(robot) if weighs else ()


EFFECT = GravityDirection(
    id="gravity_direction",
    owners=("robot",),
    form="gravity",
    parameters=tuple(EffectParameter(axis, "rad", start=0.0, prior_sigma=1.0) for axis in "xy"),
    example={"x": 0.05, "y": -0.05},
    card=Card(
        title="base that is not level",
        law="g = Exp(x e_x + y e_y) g_model, with e_x, e_y the level axes of the base: x and y where it is upright",
        explanation="The robot stands on a slope, or hangs at a wall or a ceiling that is not quite upright: the "
        "weight of the links pulls in another direction than the model has it. Correct the vector of gravity; this is "
        "no physics of the robot.",
        source="Siciliano, Khatib (2008), Springer Handbook of Robotics, ch. 2: gravity as an acceleration of the base",
        typical="0.5 to 5 degrees",
        excitation="slow motion in several postures; the first joint must turn to tell the base from its encoder",
        look_alikes={
            "encoder_offset": "at a joint with a level axis a turned base and a turned zero are the same",
            "parallel_spring": "near one posture a turned weight changes with the angle, too",
            "gravity_imbalance": "at one joint a turned weight is a sine of the angle",
            "torque_offset": "near one posture the weight is a constant torque",
            "axis_misalignment": "a base that is not level is a turned axis of the first joint",
        },
    ),
)
