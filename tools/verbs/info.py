# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope info`: shows what is in a bag, and whether a robot can use it."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointscope.tools.terminal.progress import progress_bar, reading
from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.whole_file import check_outputs, write_json

DESCRIPTION = "Describes a bag; with --robot it also says whether that robot can use it, and why not."
EXAMPLE = """example:
  jointscope info calibration.mcap
  jointscope info calibration.mcap --robot doggy --json info.json

The exit code is 0 even if the robot cannot use the bag; see the text, or `usable` in the JSON."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("bag", metavar="BAG", type=Path, help="a .bag, .mcap, .db3 or a ROS 2 bag folder")
    parser.add_argument("--robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    add_effects_option(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")


def run(args: argparse.Namespace) -> int:
    """Describes the bag; a bag that the robot cannot use is an answer, not a failure."""
    check_outputs([args.json], inputs=[args.bag, *args.effects])
    from jointscope.robots.errors import RecordingError
    from jointscope.tools.bags.describe_bag import describe_bag
    from jointscope.tools.bags.messages.open_bag import BAG_SUFFIXES

    other = Path(args.robot or "")
    if args.robot and args.bag.suffix in (".yaml", ".yml") and (other.is_dir() or other.suffix in BAG_SUFFIXES):
        raise RecordingError(
            f"{args.bag} is a robot file and no recording; the recording comes first: "
            f"jointscope info {other} --robot {args.bag}"
        )
    load_user_effects(args.effects)
    robot = None
    if args.robot:
        from jointscope.robots.files.robot_file import load_robot  # the equations of motion behind it cost time

        robot = load_robot(args.robot)
    with progress_bar() as progress:
        description = describe_bag(args.bag, robot, reading(args.bag, progress))
    if args.json is not None:
        write_json(args.json, description.to_json())
    print(description.text())
    return 0
