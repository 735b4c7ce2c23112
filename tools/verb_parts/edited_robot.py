# SPDX-License-Identifier: BSD-3-Clause
"""A robot file with effects more or less: what `jointscope add` and `jointscope remove` share."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from jointscope.robots.files.effects_at_once import EditedRobot
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.whole_file import check_outputs, whole_file, write_json

Edit = Callable[[Robot, Sequence[str]], EditedRobot]


def add_edit_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds ROBOT ID@OWNER... -o OUT.yaml [--effects FILE] [--json FILE]."""
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument(
        "labels",
        metavar="ID@OWNER",
        nargs="+",
        help="effect and what it acts on, as cogging@joint2; ID@* for everything that it can act on",
    )
    out = "robot file to write; may be ROBOT itself"
    parser.add_argument("-o", "--output", metavar="OUT.yaml", type=Path, required=True, help=out)
    add_effects_option(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")


def edit_robot(args: argparse.Namespace, edit: Edit) -> tuple[Robot, EditedRobot]:
    """Reads the robot, edits it and writes it; comments of the file survive.

    Returns:
        The robot before, and what was done to it.

    Raises:
        EffectError: an effect cannot be added or removed.
        JointscopeError: a file cannot be written; then none is.
    """
    check_outputs([args.output, args.json], inputs=[*_other_inputs(args), *args.effects])
    load_user_effects(args.effects)
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.robots.files.robot_writer import robot_text

    before = load_robot(args.robot)
    edited = edit(before, args.labels)
    with ExitStack() as stack:
        text = robot_text(edited.robot, args.output.parent)
        stack.enter_context(whole_file(args.output)).write_text(text, encoding="utf-8")
        if args.json is not None:
            write_json(stack.enter_context(whole_file(args.json)), _summary(args, before, edited))
    return before, edited


def notes(edited: EditedRobot) -> str:
    """Lines about effects that nobody named and those that were left as they are; empty without any."""
    lines = [f"{label} comes with {needs}, which acts in a spring" for label, needs in edited.brought.items()]
    lines += [f"{label} skipped: {reason}" for label, reason in edited.skipped.items()]
    return "".join(f"\n  {line}" for line in lines)


def _other_inputs(args: argparse.Namespace) -> list[Path]:
    """The robot file, where it is not the one to be written."""
    robot = Path(args.robot)
    return [robot] if robot.is_file() and robot.resolve() != args.output.resolve() else []


def only_in(robot: Robot, other: Robot) -> list[Parameter]:
    """Parameters of a robot that the other one does not have."""
    return [parameter for name, parameter in robot.parameters.items() if name not in other.parameters]


def _summary(args: argparse.Namespace, before: Robot, edited: EditedRobot) -> dict[str, Any]:
    return {
        "robot_file": str(args.output),
        "effect": args.labels[0] if len(args.labels) == 1 else None,
        "effects": list(edited.labels),
        "brought": dict(edited.brought),
        "skipped": dict(edited.skipped),
        "added": {p.name: _as_json(p) for p in only_in(edited.robot, before)},
        "removed": {p.name: _as_json(p) for p in only_in(before, edited.robot)},
    }


def _as_json(parameter: Parameter) -> dict[str, Any]:
    return {"value": parameter.value, "prior_sigma": parameter.prior_sigma, "unit": parameter.unit}
