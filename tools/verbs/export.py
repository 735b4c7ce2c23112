# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope export`: writes a calibrated robot as URDF and as MuJoCo model for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects

DESCRIPTION = "Writes a calibrated robot for other programs, and says what their formats cannot hold."
EXAMPLE = """example:
  jointscope export arm_calibrated.yaml --urdf arm_calibrated.urdf --mjcf arm.xml

The URDF is the robot's own with calibrated inertias, geometry and friction; an elastic joint becomes two. The MuJoCo
model has springs, rotors and drives as well. Values that a format cannot hold are printed, and so is what other
programs may refuse in the file."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument("--urdf", type=Path, metavar="F.urdf", help="write a URDF")
    parser.add_argument("--mjcf", type=Path, metavar="F.xml", help="write a MuJoCo model")
    add_effects_option(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")


def run(args: argparse.Namespace) -> int:
    """Makes both models, then writes both or none."""
    load_user_effects(args.effects)
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.tools.export.exported_files import export_files

    print(export_files(load_robot(args.robot), args.urdf, args.mjcf, args.json).answer())
    return 0
