# SPDX-License-Identifier: BSD-3-Clause
"""A robot file with one effect more or less: what `jointscope add` and `jointscope remove` share."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from jointscope.robots.parameter import Parameter
from jointscope.robots.robot import Robot
from jointscope.tools.user_effects import add_effects_option, load_user_effects
from jointscope.tools.whole_file import check_outputs, whole_file, write_json

Edit = Callable[[Robot, str], Robot]


def add_edit_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds ROBOT ID@OWNER -o OUT.yaml [--effects FILE] [--json FILE]."""
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument("effect", metavar="ID@OWNER", help="effect and what it acts on, as cogging@joint2")
    parser.add_argument("-o", "--output", metavar="OUT.yaml", type=Path, required=True, help="robot file to write")
    add_effects_option(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what the screen says as JSON")


def edit_robot(args: argparse.Namespace, edit: Edit) -> tuple[Robot, Robot]:
    """Reads the robot, edits it and writes it; comments of the file survive.

    Returns:
        The robot before and after.

    Raises:
        EffectError: the effect cannot be added or removed.
        JointscopeError: a file cannot be written; then none is.
    """
    robot_file = [args.robot] if Path(args.robot).is_file() else []
    check_outputs([args.output, args.json], inputs=[*robot_file, *args.effects])
    load_user_effects(args.effects)
    from jointscope.robots.robot_file import load_robot
    from jointscope.robots.robot_writer import robot_text

    before = load_robot(args.robot)
    after = edit(before, args.effect)
    with ExitStack() as stack:
        text = robot_text(after, args.output.parent)
        stack.enter_context(whole_file(args.output)).write_text(text, encoding="utf-8")
        if args.json is not None:
            write_json(stack.enter_context(whole_file(args.json)), _summary(args, before, after))
    return before, after


def only_in(robot: Robot, other: Robot) -> list[Parameter]:
    """Parameters of a robot that the other one does not have."""
    return [parameter for name, parameter in robot.parameters.items() if name not in other.parameters]


def _summary(args: argparse.Namespace, before: Robot, after: Robot) -> dict[str, Any]:
    return {
        "robot_file": str(args.output),
        "effect": args.effect,
        "added": {p.name: _as_json(p) for p in only_in(after, before)},
        "removed": {p.name: _as_json(p) for p in only_in(before, after)},
    }


def _as_json(parameter: Parameter) -> dict[str, Any]:
    return {"value": parameter.value, "prior_sigma": parameter.prior_sigma, "unit": parameter.unit}
