# SPDX-License-Identifier: BSD-3-Clause
"""An effect put into the one model that recordings of all kinds share, in the words of those that know it.

The catalogue is what motion and rests read, names of arm_effects.py are what poses and frequency responses read. Where
both have the same names an effect is one number for all kinds; so is a gap, which poses read as motion has it, too.
A rigid joint becomes an elastic one, whose spring all kinds read. Where they have other laws for it (a bearing that
turns with the arm or stands before the joint, an inertia), each side that shows it gets its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from jointscope.graphs.across_kinds.said_by_kinds import MOTION, RESTS, AcrossKinds
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect, cannot_be_added, remove_effect
from jointscope.robots.files.elastic_joint import ELASTICITY, with_spring
from jointscope.robots.geometry.added_effect import with_effect
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES, ArmHypothesis
from jointscope.robots.geometry.error_parameters import STIFFNESS
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter


def with_shared_effect(
    robot: Robot, found: AcrossKinds, hypothesis: ArmHypothesis | None, refit: Robot | None = None
) -> Robot:
    """The robot with one more effect, beginning at the sizes that were seen.

    Args:
        robot: the model.
        found: what all kinds say of the effect.
        hypothesis: as poses and frequency responses know it; None where they do not.
        refit: the model of the motion with the effect, fitted there; None where motion does not show it.

    Raises:
        EffectError: no kind has a form of it that can be added.
    """
    effect, _, owner = found.label.partition("@")
    start = _sizes(found)
    if refit is not None:
        begin = f"{owner}.{effect}."
        start |= {n.removeprefix(begin): p.value for n, p in refit.parameters.items() if n.startswith(begin)}
    if effect == ELASTICITY and hypothesis is not None and owner in robot.choices.rigid_joints:
        return with_spring(robot, owner, start)
    grown = robot
    if hypothesis is None or _of_catalogue(robot, effect, owner):
        known = add_effect(robot, found.label, start)
        same = hypothesis is not None and {*hypothesis.catalogue_names} <= {*known.parameters}
        if same or {MOTION, RESTS} & {*found.shown_by}:
            grown = known
    if hypothesis is not None and {POSES, FREQUENCY} & {*found.shown_by}:
        if not {*hypothesis.catalogue_names} <= {*grown.parameters}:
            grown = with_effect(grown, hypothesis, _of_arm(hypothesis, start))
    return grown


def without_shared_effect(robot: Robot, label: str, before: Robot) -> Robot:
    """The robot without an effect that `before` did not have, the other values as they are."""
    if any(here.label == label for here in robot.effects):
        robot = remove_effect(robot, label)
    left = {n: p for n, p in robot.parameters.items() if n in before.parameters or not _is_of(n, p, label)}
    return replace(robot, parameters=left)


def own_names(robot: Robot, before: Robot) -> tuple[str, ...]:
    """Names of the parameters that came in with an effect."""
    return tuple(name for name in robot.parameters if name not in before.parameters)


def _is_of(name: str, parameter: Parameter, label: str) -> bool:
    effect, _, owner = label.partition("@")
    return parameter.effect == effect and name.partition(".")[0] in (owner, "robot", "tracker")


def _sizes(found: AcrossKinds) -> dict[str, float]:
    """Sizes by the last part of their names, of the kind with the most evidence that tells them."""
    shown = sorted(found.shown_by, key=lambda kind: found.by_kind[kind].evidence)
    sizes: dict[str, float] = {}
    for kind in shown:
        sizes |= {name: value for name, (value, _, _) in found.by_kind[kind].sizes.items()}
    return sizes


def _of_catalogue(robot: Robot, effect: str, owner: str) -> bool:
    """Whether motion and rests can have an effect."""
    known = catalogue().get(effect)
    moves = robot.command is not None
    return moves and known is not None and not cannot_be_added(robot, EffectAt(known, owner))


def _of_arm(hypothesis: ArmHypothesis, start: Mapping[str, float]) -> dict[str, float]:
    """Values of an arm's parameters by full name; of what is soft, stiffnesses from compliances."""
    found = {}
    softest = max((abs(value) for value in start.values()), default=1.0)
    for name in hypothesis.names:
        last = name.rpartition(".")[2]
        if hypothesis.kind.soft:
            found[name] = 1.0 / max(start[last.replace(STIFFNESS, "compliance")], 0.1 * softest)
        elif hypothesis.kind.catalogue[0]:
            found[name] = hypothesis.kind.catalogue[1] * start[hypothesis.kind.catalogue[0].rpartition(".")[2]]
        else:
            found[name] = start[last]
    return found
