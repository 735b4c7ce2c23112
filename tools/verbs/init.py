# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope init`: writes a first robot file from a URDF and a bag, and marks what it guessed."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointscope.tools.terminal.progress import progress_bar, reading
from jointscope.tools.writing.whole_file import check_outputs, whole_file, write_json

if TYPE_CHECKING:
    from jointscope.robots.model.robot import Robot
    from jointscope.tools.init.robot_guess import RobotGuess
    from jointscope.tools.init.streams.named_signal import Wish
    from jointscope.tools.init.streams.other_joints import Typed

DESCRIPTION = "Writes a robot file for a robot of your own."
EXAMPLE = """example:
  jointscope init arm.urdf moves.mcap -o arm.yaml
  jointscope info moves.mcap --robot arm.yaml
  jointscope calibrate arm.yaml moves.mcap -o arm_calibrated.yaml
  jointscope discover arm.yaml moves.mcap --holdout-share 0.33 -o better.yaml

The recording should move every joint, several at once. `init` guesses joints, topics, units, signs, the link and the
mounting of each gyroscope, the noise of the sensors, and, by regression, gravity, the unit of the command and the
drives, which it prints as a table with sigmas. Every guess is in the file, with its reason."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("urdf", metavar="URDF", type=Path, help="bodies and joints of the robot")
    parser.add_argument("bag", metavar="BAG", type=Path, help="a .bag, .mcap, .db3 or a ROS 2 bag folder")
    parser.add_argument("-o", "--output", metavar="ROBOT", type=Path, required=True, help="robot file to write")
    parser.add_argument("--name", default="", help="name of the robot; by default that of the URDF file")
    parser.add_argument(
        "--joints",
        default="",
        metavar="A,B,...",
        help="joints to use, if not all that move and are driven; A=NAME gives the name of joint A in the messages",
    )
    parser.add_argument(
        "--lock", default="", metavar="A,B,...", help="joints to hold at their mean although they move in the bag"
    )
    parser.add_argument(
        "--unit",
        default="",
        type=lambda text: text.replace(" ", ""),  # robot files say "N m"
        choices=("duty", "V", "A", "Nm"),
        help="unit of the command, if you know it; by default guessed from its size and the masses of the URDF",
    )
    parser.add_argument(
        "--target",
        action="append",
        default=[],
        metavar="TOPIC=LINK",
        help="topic with positions of a point on this link, from a camera or motion capture; may be repeated",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the guesses as JSON")


def run(args: argparse.Namespace) -> int:
    """Guesses, writes, reads the file again and says whether the bag fits it."""
    check_outputs([args.output, args.json], inputs=[args.urdf, args.bag])
    from jointscope.robots.files.robot_file import load_robot, urdf_reference
    from jointscope.tools.bags.descriptions.describe_bag import describe_bag
    from jointscope.tools.init.estimates.target_places import find_targets
    from jointscope.tools.init.robot_guess import guess_robot
    from jointscope.tools.init.streams.other_joints import Typed
    from jointscope.tools.init.text.drive_table import drive_content, drive_table
    from jointscope.tools.init.text.guessed_lines import guesses, guesses_in_sections
    from jointscope.tools.init.text.held_text import locked_line
    from jointscope.tools.init.text.robot_text import robot_text

    _check_order(args.urdf, args.bag, args.output)
    unit, targets = args.unit.replace("Nm", "N m"), tuple(args.target)
    typed = Typed(args.urdf, args.bag, args.output, _wish(args.joints, args.lock), args.name, unit, targets)
    with progress_bar() as progress:
        guess = guess_robot(typed, reading(args.bag, progress))
        urdf = urdf_reference(args.urdf, args.output.parent)
        with whole_file(args.output) as unfinished:
            unfinished.write_text(robot_text(guess, urdf), encoding="utf-8")
            robot = load_robot(unfinished)
            guess = _with_position_hints(guess, robot, args.bag, targets)
            text = robot_text(guess, urdf, find_targets(args.bag, robot, targets))
            unfinished.write_text(text, encoding="utf-8")
            robot = load_robot(unfinished)
        description = describe_bag(args.bag, replace(robot, path=args.output))
    if args.json is not None:
        content: dict[str, Any] = {
            "robot": str(args.output),
            "joints": list(guess.roles.joints),
            "guesses": guesses(text),
        }
        content["drives"] = drive_content(guess)
        content["locked"] = {h.joint: h.position for h in guess.held}
        write_json(args.json, content | {"usable": description.usable, "problem": description.problem})
    print(f"{guess.name}: {', '.join(guess.roles.joints)}; inferred from the recording:")
    held = {h.joint for h in guess.held}
    for line in guesses_in_sections(text):
        key = line.partition(":")[0].strip("'")
        if key not in held and key != "parameters":  # these stand in the table that follows
            print(f"  {_plain(line)}")
    print("\n".join(drive_table(guess)))
    lines = [*([locked_line(guess.held)] if held else []), *guess.following]
    lines += [f"not used: {text}" for text in guess.left_out]
    said = "" if guess.exchanged is None else guess.exchanged.seen  # below, with what mends it
    notes = [f"note: {notice}" for notice in description.notices if not said or said not in notice]
    for line in (*(f"  {line}" for line in lines), *notes):
        print(line)
    if not description.usable:
        print(f"\nWrote {args.output}; the recording cannot be used with it: {description.problem}")
        return 0
    _say_whether_usable(args, guess, typed)
    calibrated = args.output.with_name(f"{args.output.stem}_calibrated.yaml")
    better = args.output.with_name(f"{args.output.stem}_better.yaml")
    print(f"Check the lines marked GUESS, then: jointscope calibrate {args.output} {args.bag} -o {calibrated}")
    print(f"What it lacks: jointscope discover {args.output} {args.bag} --holdout-share 0.33 -o {better}")
    return 0


def _with_position_hints(guess: RobotGuess, robot: Robot, bag: Path, targets: Sequence[str]) -> RobotGuess:
    """What may be done with positions in the bag, where there are masses."""
    from jointscope.tools.init.estimates.target_places import position_topics
    from jointscope.tools.init.text.target_text import position_hints

    if guess.free_links:
        return guess
    links = [body for body in robot.tree.bodies if robot.tree.joints_below(body)]
    return replace(guess, left_out=[*guess.left_out, *position_hints(list(position_topics(bag)), targets, links)])


def _say_whether_usable(args: argparse.Namespace, guess: RobotGuess, typed: Typed) -> None:
    """Whether the regression explains the recording; what to look at where it does not."""
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.robots.model.command_words import edited_file
    from jointscope.tools.bags.read_recording import read_recording
    from jointscope.tools.init.estimates.drive_values import EXPLAINED
    from jointscope.tools.init.estimates.wiring_by_torques import exchange_sentence
    from jointscope.tools.init.what_is_missing import what_is_missing

    poor = [
        joint
        for joint, drive in zip(guess.roles.joints, guess.drives, strict=True)
        if drive.explained < EXPLAINED or drive.is_impossible
    ]
    if poor and not guess.free_links:
        robot = load_robot(args.output)
        if guess.exchanged is not None:
            again = replace(typed, output=edited_file(args.output, "exchanged"))
            why = exchange_sentence(guess.exchanged, robot, again)
        else:
            why = what_is_missing(robot, read_recording(args.bag, robot), poor)
        print(
            f"\nWrote {args.output}; the recording can be read with it, but the regression does not explain "
            f"{', '.join(poor)} (table above): {why}"
        )
    else:
        print(f"\nWrote {args.output}; the recording can be used with it")


def _check_order(urdf: Path, bag: Path, output: Path) -> None:
    """Says at once that a URDF is missing, or that bag and URDF have changed places."""
    from jointscope.robots.errors import RobotError
    from jointscope.robots.yaml_section import did_you_mean
    from jointscope.tools.bags.messages.open_bag import BAG_SUFFIXES

    if bag.suffix == ".urdf" and (urdf.is_dir() or urdf.suffix in BAG_SUFFIXES):
        raise RobotError(f"{urdf} is no URDF; the URDF comes first: jointscope init {bag} {urdf} -o {output}")
    if not urdf.is_file():
        others = sorted(path.name for path in urdf.parent.glob("*.urdf")) if urdf.parent.is_dir() else []
        raise RobotError(f"there is no URDF {urdf}{did_you_mean(urdf.name, others) if others else ''}")


def _plain(line: str) -> str:
    """A guess without the brackets and quotes of its file."""
    value, bracket, reason = line.partition("  (")
    return value.replace("['", "").replace("']", "").replace("', '", ", ").replace("[", "").replace("]", "") + (
        bracket + reason
    )


def _wish(joints: str, locked: str) -> Wish:
    """What the options say about joints."""
    from jointscope.tools.init.streams.named_signal import Wish

    given = [part.strip().partition("=") for part in joints.split(",") if part.strip()]
    return Wish(
        joints=tuple(joint.strip() for joint, _, _ in given),
        names={joint.strip(): name.strip() for joint, mark, name in given if mark},
        locked=tuple(joint.strip() for joint in locked.split(",") if joint.strip()),
    )
