# SPDX-License-Identifier: BSD-3-Clause
"""A joint that was taken for rigid and is not: it gets the spring that recordings of every kind read."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace

from ruamel.yaml.comments import CommentedMap

from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import carried_noise
from jointscope.robots.geometry.error_parameters import DAMPING, STIFFNESS
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter

ELASTICITY = "joint_elasticity"
SPREAD = 1.1  # of the size of a spring that is new, 1 sigma over its value


def with_spring(robot: Robot, joint: str, start: Mapping[str, float]) -> Robot:
    """The robot with a joint that is not rigid any more, the way a robot file has an elastic joint.

    Args:
        robot: with the joint among its rigid ones.
        joint: its name.
        start: compliance [rad/(N m)] and damping [N m s/rad], where they are known; else as usual.
    """
    usual = {p.name: p.start for p in catalogue()[ELASTICITY].parameters_at(robot, joint)}
    sizes = {
        STIFFNESS: (1.0 / start.get("compliance", usual["compliance"]), "N m/rad"),
        DAMPING: (start.get(DAMPING, usual[DAMPING]), "N m s/rad"),
    }
    parameters = dict(robot.parameters)
    for part, (value, unit) in sizes.items():
        name = f"{joint}.{part}"
        parameters[name] = Parameter(name, value, unit, value, SPREAD * value, effect=ELASTICITY)
    left = tuple(each for each in robot.choices.rigid_joints if each != joint)
    document = copy.deepcopy(robot.document)
    document.setdefault("model", CommentedMap())["rigid_joints"] = list(left)
    choices = replace(robot.choices, rigid_joints=left)
    new = replace(robot, parameters=parameters, choices=choices, document=document)
    return replace(new, noise=carried_noise(robot, new))
