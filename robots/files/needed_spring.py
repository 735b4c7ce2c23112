# SPDX-License-Identifier: BSD-3-Clause
"""Effects of a spring, and the spring that a joint declared rigid must get first.

A law of the spring's side changes the torque between motor and link. A rigid joint has neither the torque nor the
coordinates that it depends on; `joint_elasticity` gives it both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import is_spring_law
from jointscope.robots.effect_kinds.robot_torque import RobotTorque
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.effect_kinds.transmission_elements import TransmissionElements

if TYPE_CHECKING:
    from jointscope.robots.model.robot import Robot

SPRING = "joint_elasticity"


def is_spring(here: EffectAt) -> bool:
    """Whether an effect is a spring between motor and link."""
    return isinstance(here.effect, Structure) and here.effect.form == "elasticity"


def needed_spring(robot: Robot, here: EffectAt) -> str:
    """The label ID@OWNER of the spring that an effect needs and a robot lacks; empty if it lacks none."""
    lacks = here.owner in robot.joints and here.owner not in robot.layout.motors
    return f"{SPRING}@{here.owner}" if lacks and _acts_in_spring(here) else ""


def effects_of_spring(robot: Robot, spring: EffectAt) -> tuple[str, ...]:
    """Labels of a robot's effects that act in a spring: without it they have nothing to act on."""
    return tuple(e.label for e in robot.effects if e.owner == spring.owner and _acts_in_spring(e))


def _acts_in_spring(here: EffectAt) -> bool:
    effect = here.effect
    return isinstance(effect, RobotTorque | TransmissionElements) or is_spring_law(effect)
