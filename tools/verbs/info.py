# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope info`: shows what is in a bag, and whether a robot can use it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointscope.tools.terminal.progress import progress_bar, reading
from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.whole_file import check_outputs, write_json

if TYPE_CHECKING:
    from jointscope.robots.model.robot import Robot

DESCRIPTION = "Describes a bag; with --robot it also says whether that robot can use it, and why not."
EXAMPLE = """example:
  jointscope info calibration.mcap
  jointscope info calibration.mcap --robot doggy --json info.json
  jointscope info bench.mcap --robot arm.yaml --locked-springs

The exit code is 0 even if the robot cannot use the bag; see the text, or `usable` in the JSON."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("bag", metavar="BAG", type=Path, help="a .bag, .mcap, .db3 or a ROS 2 bag folder")
    parser.add_argument("--robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument(
        "--locked-springs",
        action="store_true",
        help="springs were locked in this recording: it shows the transmission (docs/locked_springs.md)",
    )
    add_effects_option(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")


def run(args: argparse.Namespace) -> int:
    """Describes the bag; a bag that the robot cannot use is an answer, not a failure."""
    check_outputs([args.json], inputs=[args.bag, *args.effects])
    from jointscope.robots.errors import RecordingError
    from jointscope.tools.bags.descriptions.describe_bag import describe_bag
    from jointscope.tools.bags.messages.open_bag import BAG_SUFFIXES

    other = Path(args.robot or "")
    if args.robot and args.bag.suffix in (".yaml", ".yml") and (other.is_dir() or other.suffix in BAG_SUFFIXES):
        raise RecordingError(
            f"{args.bag} is a robot file and no recording; the recording comes first: "
            f"jointscope info {other} --robot {args.bag}"
        )
    load_user_effects(args.effects)
    robot, locked = None, False
    if args.robot:
        from jointscope.robots.files.robot_file import load_robot  # the equations of motion behind it cost time
        from jointscope.robots.files.sections.locked_section import names_recording

        robot = load_robot(args.robot)
        locked = args.locked_springs or names_recording(robot, args.bag)
    if args.locked_springs and robot is None:
        raise RecordingError("--locked-springs compares motors and links; give --robot, too: it names their topics")
    with progress_bar() as progress:
        if robot is not None and locked:
            content, text = _locked(args.bag, robot)
        else:
            description = describe_bag(args.bag, robot, reading(args.bag, progress))
            content, text = description.to_json(), description.text()
    if args.json is not None:
        write_json(args.json, content)
    print(text)
    return 0


def _locked(bag: Path, robot: Robot) -> tuple[dict[str, Any], str]:
    """What a bag with locked springs has, and the transmission that it shows, for machines and for the screen."""
    from jointscope.robots.errors import JointscopeError
    from jointscope.tools.bags.descriptions.describe_bag import describe_bag
    from jointscope.tools.bags.read_locked import read_coupling
    from jointscope.tools.terminal.coupling_text import coupling_text

    described = describe_bag(bag)
    content = described.to_json() | {"robot": robot.name}
    try:
        coupling = read_coupling([bag], robot)
    except JointscopeError as err:
        said = f"The recording does not show the transmission of {robot.name}: {err}"
        return content | {"usable": False, "problem": str(err)}, f"{described.text()}\n\n{said}"
    found = {"usable": True, "problem": None, "coupling": coupling.to_json()}
    return content | found, f"{described.text()}\n\n{coupling_text(coupling)}"
