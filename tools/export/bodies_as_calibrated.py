# SPDX-License-Identifier: BSD-3-Clause
"""The robot whose bodies and springs are as its effects say, so that those effects are no longer beside it."""

from __future__ import annotations

from dataclasses import replace

from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import StructuredTree


def is_spring(here: EffectAt) -> bool:
    """Whether it is the elasticity of a joint that the file declares rigid."""
    return isinstance(here.effect, Structure) and here.effect.form == "elasticity"


def bodies_as_calibrated(robot: Robot) -> Robot:
    """The same robot, with changed inertias in its tree and calibrated elasticities as springs of the base model.

    Args:
        robot: a robot with equations of motion.

    Returns:
        The robot without these effects; all others are still there.
    """
    of_bodies = tuple(here for here in robot.effects if isinstance(here.effect, InertiaEffect))
    tree = robot.tree
    if of_bodies:
        tree = tree.with_model(StructuredTree(replace(robot, effects=of_bodies)).bodies(robot.values).model)
    springs = [here for here in robot.effects if is_spring(here)]
    parameters = dict(robot.parameters)
    for here in springs:
        compliance, damping = (robot.parameter(here.parameter(name)) for name in ("compliance", "damping"))
        stiffness = f"{here.owner}.stiffness"
        parameters[stiffness] = replace(compliance, name=stiffness, value=1.0 / compliance.value, effect=None)
        parameters[f"{here.owner}.damping"] = replace(damping, name=f"{here.owner}.damping", effect=None)
    soft = {here.owner for here in springs}
    return replace(
        robot,
        tree=tree,
        parameters=parameters,
        choices=replace(robot.choices, rigid_joints=tuple(j for j in robot.choices.rigid_joints if j not in soft)),
        effects=tuple(here for here in robot.effects if here not in of_bodies and here not in springs),
    )
