# SPDX-License-Identifier: BSD-3-Clause
"""Several effects of a robot added or removed at once: `ID@*` means everything that the effect can act on.

Who names an owner gets that effect or an error. Behind `*` an owner on which the effect cannot act is skipped with its
reason. An effect of a spring brings the spring to a joint that is declared rigid.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_catalogue import find_effect, parse_effect, without_alias
from jointscope.robots.files.effect_editing import add_effect, cannot_be_added, remove_effect
from jointscope.robots.files.needed_spring import SPRING, effects_of_spring, is_spring, needed_spring
from jointscope.robots.model.robot import Robot

EVERY = ("*", "all")  # owners of a label that stands for many


@dataclass(frozen=True)
class EditedRobot:
    """A robot after several edits.

    Attributes:
        robot: the robot.
        labels: effects that were added or removed, ID@OWNER, in the order in which it was done.
        brought: those among them that nobody named, each with the effect that needs it.
        skipped: those behind a `*` that were left as they are, each with the reason.
    """

    robot: Robot
    labels: tuple[str, ...]
    brought: Mapping[str, str]
    skipped: Mapping[str, str]


def add_effects(robot: Robot, wanted: Sequence[str]) -> EditedRobot:
    """Adds effects at their start values.

    Args:
        robot: the robot.
        wanted: labels ID@OWNER or ID@*.

    Raises:
        EffectError: an effect that was named with its owner cannot be added, or nothing is left of an ID@*.
    """
    named, groups = _expanded(wanted, lambda effect_id: _possible_owners(robot, effect_id))
    # springs first: then those that act in them find them
    labels = sorted([*named, *(label for group in groups.values() for label in group)], key=_is_no_spring)
    added: list[str] = []
    brought: dict[str, str] = {}
    skipped: dict[str, str] = {}
    for label in labels:
        why_not = "" if label in named else _why_not_added(robot, label)
        if why_not:
            skipped[label] = why_not
            continue
        effect, owner = parse_effect(label, robot)
        spring = needed_spring(robot, EffectAt(effect, owner))
        if spring:
            robot = add_effect(robot, spring)
            brought[spring] = label
            added.append(spring)
        robot = add_effect(robot, label)
        added.append(label)
    _need_some(robot, groups, skipped, "added to")
    return EditedRobot(robot, tuple(added), brought, skipped)


def remove_effects(robot: Robot, wanted: Sequence[str]) -> EditedRobot:
    """Removes effects.

    Args:
        robot: the robot.
        wanted: labels ID@OWNER or ID@*.

    Raises:
        EffectError: the robot does not have an effect that was named, it has to stay, or nothing is left of an ID@*.
    """
    there = {here.label: here for here in robot.effects}

    def owners(effect_id: str) -> tuple[str, ...]:
        found = tuple(here.owner for here in robot.effects if here.effect.id == effect_id)
        if not found:
            remove_effect(robot, f"{effect_id}@*")  # says what there is
        return found

    named, groups = _expanded(wanted, owners)
    # springs last: what acts in them goes before
    labels = sorted([*named, *(label for group in groups.values() for label in group)], key=_is_no_spring, reverse=True)
    removed: list[str] = []
    skipped: dict[str, str] = {}
    for label in labels:
        stays = effects_of_spring(robot, there[label]) if label in there and is_spring(there[label]) else ()
        if stays and label not in named:
            skipped[label] = f"{', '.join(stays)} needs it"
            continue
        robot = remove_effect(robot, label)
        removed.append(label)
    _need_some(robot, groups, skipped, "removed from")
    return EditedRobot(robot, tuple(removed), {}, skipped)


def without_effects(robot: Robot) -> Robot:
    """The base model of a robot: all its effects removed."""
    return remove_effects(robot, [here.label for here in robot.effects]).robot if robot.effects else robot


def _expanded(wanted: Sequence[str], owners: Callable[[str], Sequence[str]]) -> tuple[list[str], dict[str, list[str]]]:
    """Labels with an owner, and for each ID@* the labels that it stands for and that are not named beside it."""
    wanted = [without_alias(text) for text in wanted]
    for text in wanted:
        if list(wanted).count(text) > 1:
            raise EffectError(f"{text} is named twice; name each effect once")
    named = [text for text in wanted if not _stands_for_many(text)]
    groups: dict[str, list[str]] = {}
    taken = set(named)
    for text in wanted:
        if _stands_for_many(text):
            effect_id = text.partition("@")[0]
            groups[text] = [label for owner in owners(effect_id) if (label := f"{effect_id}@{owner}") not in taken]
            taken.update(groups[text])
    return named, groups


def _stands_for_many(text: str) -> bool:
    return text.partition("@")[2] in EVERY


def _is_no_spring(label: str) -> bool:
    return label.partition("@")[0] != SPRING


def _possible_owners(robot: Robot, effect_id: str) -> tuple[str, ...]:
    """Everything in a robot of the kinds that an effect acts on, also where it cannot."""
    effect = find_effect(effect_id)
    joints = robot.joints if "joint" in effect.owners else ()
    whole = ("robot",) if "robot" in effect.owners else ()
    owners = tuple(dict.fromkeys((*joints, *effect.owners_of(robot), *whole)))
    if not owners:
        raise EffectError(f"{effect_id}@*: {robot.name} has no {_kinds(effect)} that it could act on")
    return owners


def _kinds(effect: Effect) -> str:
    return " or ".join(kind.replace("_", " ") for kind in effect.owners)


def _why_not_added(robot: Robot, label: str) -> str:
    """Why an effect behind a `*` is skipped; empty if it can be added."""
    effect_id, _, owner = label.partition("@")
    if robot.has_effect(effect_id, owner):
        return "is there already"
    here = EffectAt(find_effect(effect_id), owner)
    return here.effect.may_act_on(robot, owner) if needed_spring(robot, here) else cannot_be_added(robot, here)


def _need_some(robot: Robot, groups: Mapping[str, Sequence[str]], skipped: Mapping[str, str], done: str) -> None:
    """Complains about an ID@* of which nothing is left."""
    for text, labels in groups.items():
        if labels and all(label in skipped for label in labels):
            reasons = "; ".join(f"{label}: {skipped[label]}" for label in labels)
            raise EffectError(f"{text}: nothing to be {done} {robot.name}: {reasons}")
