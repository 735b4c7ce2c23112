# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope compare`: predicts a recording with one or more models; errors per channel and horizon."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jointscope.robots.errors import JointscopeError, RobotError
from jointscope.tools.acceptance.evaluation import acceptance_json, check_models
from jointscope.tools.acceptance.limits import Limit
from jointscope.tools.presentation.left_out import add_leave_out_option, leave_out
from jointscope.tools.terminal.progress import progress_bar, reading
from jointscope.tools.verb_parts.acceptance import add_accept_option, limits_of, print_acceptance
from jointscope.tools.verb_parts.bag_arguments import add_kind_options
from jointscope.tools.verb_parts.frequency_runs import run_frequency_comparison
from jointscope.tools.verb_parts.pose_runs import compare_poses
from jointscope.tools.verb_parts.rest_runs import compare_rests
from jointscope.tools.verb_parts.result_files import ResultFiles, add_result_options, check_viewer
from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.whole_file import check_outputs, write_json

DESCRIPTION = "Predicts a recording with one or more models and shows where and when they fail."
EXAMPLE = """example:
  jointscope compare doggy doggy_calibrated.yaml moves.mcap --report comparison.html

The last argument is the bag; all before it are robots. Use a recording that was not used for calibration.
With poses or frequency responses:
  jointscope compare arm.yaml --poses other_poses.csv
  jointscope compare tx90l arm.yaml --frequency frequency_P2 --report matrix.html"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    add_models_and_bag(parser)
    add_kind_options(parser)
    add_accept_option(parser)
    add_result_options(parser)


def add_models_and_bag(parser: argparse.ArgumentParser) -> None:
    """Adds ROBOT... BAG [--leave-out T0:T1] [--effects FILE]."""
    parser.add_argument(
        "robots",
        metavar="ROBOT... BAG",
        nargs="+",
        help="names of ready robots, or robot files; last a .bag, .mcap, .db3 or a ROS 2 bag folder",
    )
    parser.set_defaults(parser=parser)
    add_leave_out_option(parser)
    add_effects_option(parser)


def run(args: argparse.Namespace) -> int:
    """Compares, writes the files, and says what was found."""
    files = ResultFiles.of(args)
    poses: list[Path] = getattr(args, "poses", [])
    rests: list[Path] = getattr(args, "rests", [])
    frequency: list[Path] = getattr(args, "frequency", [])
    still = [*poses, *rests, *frequency]
    if sum(map(bool, (poses, rests, frequency))) > 1:
        raise RobotError("poses, rests and frequency responses are compared one after the other; give one kind")
    if not still:
        *args.robots, bag = args.robots
        args.bag = Path(bag)
        if not args.robots:
            args.parser.error(f"expected ROBOT... BAG, got {bag} alone; to compare on poses: --poses TABLE-or-BAG")
    names = labels(args.robots)
    robot_files = [robot for robot in args.robots if Path(robot).is_file()]
    check_outputs(files.all, inputs=[*([] if still else [args.bag]), *still, *robot_files, *args.effects])
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.tools.bags.needed_streams import check_same_streams
    from jointscope.tools.bags.read_motion import read_motion
    from jointscope.tools.notebook.calls import compare
    from jointscope.tools.terminal.comparison_text import comparison_text

    load_user_effects(args.effects)
    robots = {label: load_robot(robot) for label, robot in zip(names, args.robots, strict=True)}
    limits = limits_of(args, robots.values())
    if poses:
        return _on_poses(robots, poses, files, limits)
    if rests:
        return _on_rests(robots, rests, files, limits)
    if frequency:
        return _on_frequency(robots, frequency, files, limits)
    check_same_streams(robots)  # before the bag is read for the first of them
    for robot in robots.values():
        check_viewer(robot, files)
    with progress_bar() as progress:
        first = next(iter(robots.values()))
        (recording,) = leave_out([read_motion(args.bag, first, reading(args.bag, progress))], args.leave_out)
        result = compare(robots, recording, accept=limits, progress=progress)
        result.write(files)
    print(comparison_text(result))
    files.tell()
    return print_acceptance(result.acceptance)


def _on_poses(robots: dict[str, Any], poses: Sequence[Path], files: ResultFiles, limits: Sequence[Limit]) -> int:
    """Compares the models on poses; raises RobotError where pictures were asked for."""
    _no_pictures(files, "poses")
    return _told(*compare_poses(robots, poses), files, limits)


def _on_rests(robots: dict[str, Any], rests: Sequence[Path], files: ResultFiles, limits: Sequence[Limit]) -> int:
    """Compares the models on rests; raises RobotError where pictures were asked for."""
    _no_pictures(files, "rests")
    with progress_bar() as progress:
        text, content = compare_rests(robots, rests, progress)
    return _told(text, content, files, limits)


def _on_frequency(robots: dict[str, Any], bags: Sequence[Path], files: ResultFiles, limits: Sequence[Limit]) -> int:
    """Compares the models on frequency responses."""
    with progress_bar() as progress:
        text, checked = run_frequency_comparison(robots, bags, files, limits, progress)
    print(text)
    files.tell()
    return print_acceptance(checked)


def _no_pictures(files: ResultFiles, kind: str) -> None:
    if files.pictures:
        raise RobotError(f"pictures of {kind} come with `jointscope calibrate ROBOT --{kind} ... --report F.html`")


def _told(text: str, content: dict[str, Any], files: ResultFiles, limits: Sequence[Limit]) -> int:
    """Writes JSON, says what was found and which limits are kept; returns the exit code."""
    checked = check_models(limits, content["models"])
    if files.json is not None:
        write_json(files.json, content | acceptance_json(checked))
    print(text)
    return print_acceptance(checked)


def labels(robots: Sequence[str]) -> list[str]:
    """A short name for each robot: the file's stem where that is unique, else what the user typed.

    Raises:
        JointscopeError: the same robot twice.
    """
    stems = [Path(robot).stem for robot in robots]
    names = [stem if stems.count(stem) == 1 else robot for stem, robot in zip(stems, robots, strict=True)]
    for name in names:
        if names.count(name) > 1:
            raise JointscopeError(f"the robot {name} is named twice; name each model once")
    return names
