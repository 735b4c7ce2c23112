# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope export`: a calibrated robot for other programs, as URDF and as MuJoCo model."""

from __future__ import annotations

import argparse
import textwrap
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointscope.robots.errors import RobotError
from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.whole_file import check_outputs, whole_file, write_json

if TYPE_CHECKING:
    from jointscope.tools.export.exported import Exported

WIDTH = 110
EXAMPLE = """example:
  jointscope export arm_calibrated.yaml --urdf arm_calibrated.urdf --mjcf arm.xml

The URDF is the robot's own with calibrated inertias, geometry and friction; an elastic joint becomes two. The MuJoCo
model has springs, rotors and drives as well. What a format cannot hold is said, with its value."""


def add_parser(subparsers: Any) -> None:
    """Adds the verb to the command line."""
    parser = subparsers.add_parser(
        "export",
        help="writes a calibrated robot as URDF or MuJoCo model",
        description="Writes a calibrated robot for other programs, and says what their formats cannot hold.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument("--urdf", type=Path, metavar="F.urdf", help="write a URDF")
    parser.add_argument("--mjcf", type=Path, metavar="F.xml", help="write a MuJoCo model")
    add_effects_option(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what the screen says as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Makes both models, then writes both or none."""
    if args.urdf is None and args.mjcf is None:
        raise RobotError(f"nothing to write; name a file: jointscope export {args.robot} --urdf F.urdf --mjcf F.xml")
    check_outputs([args.urdf, args.mjcf, args.json], [args.robot])
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.tools.export.mujoco_model import mujoco_model
    from jointscope.tools.export.urdf_model import urdf_model

    load_user_effects(args.effects)
    robot = load_robot(args.robot)
    wanted = [(args.urdf, "urdf", urdf_model), (args.mjcf, "mjcf", mujoco_model)]
    made = {kind: (path, export(robot)) for path, kind, export in wanted if path is not None}
    with ExitStack() as stack:
        for path, exported in made.values():
            stack.enter_context(whole_file(path)).write_text(exported.text, encoding="utf-8")
        if args.json is not None:
            content = {"robot": robot.name, **{kind: exported.to_json() for kind, (_, exported) in made.items()}}
            write_json(stack.enter_context(whole_file(args.json)), content)
    print("\n\n".join(_told(path, exported) for path, exported in made.values()))
    return 0


def _told(path: Path, exported: Exported) -> str:
    lines = textwrap.wrap(f"Wrote {path}: {', '.join(exported.holds)}", WIDTH, subsequent_indent="  ")
    if exported.lacks:
        lines.append("Not in it:")
    for name, reason in exported.lacks.items():
        lines += textwrap.wrap(f"{name}: {reason}", WIDTH, initial_indent="  ", subsequent_indent="    ")
    return "\n".join(lines)
