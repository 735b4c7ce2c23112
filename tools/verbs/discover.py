# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope discover`: calibrates, diagnoses, adds what is missing, and repeats until nothing helps."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointscope.robots.errors import JointscopeError
from jointscope.robots.model.robot import Robot
from jointscope.tools.terminal.progress import Progress, progress_bar
from jointscope.tools.verb_parts.bag_arguments import add_bag_arguments, check_kind, input_files, read_bags
from jointscope.tools.verb_parts.result_files import ResultFiles, add_result_options, check_viewer, write_discovery
from jointscope.tools.verb_parts.searches.arm_search import run_arm_search
from jointscope.tools.verb_parts.searches.kinds_search import run_kinds_discovery, several_graphs
from jointscope.tools.verb_parts.searches.rest_search import run_rest_search
from jointscope.tools.verb_parts.user_effects import load_user_effects
from jointscope.tools.verb_parts.workers import add_workers_option, check_one_choice, check_workers, workers_of
from jointscope.tools.writing.whole_file import check_outputs

if TYPE_CHECKING:
    from jointscope.graphs.discovery.side_by_side import SideBySide

DESCRIPTION = (
    "Finds the physical effects that a model lacks and adds them one by one. An effect is chosen on\n"
    "blocks of the training recordings that its first fit leaves out; it stays if the error on the training\n"
    "recordings also falls when the model is calibrated with all of them. The held-out recording is only scored."
)
EXAMPLE = """example:
  jointscope discover doggy train.mcap --holdout test.mcap -o found.yaml --report discovery.html
  jointscope discover biorob --rests spring1 spring2 gravity --holdout-rests spring3 -o found.yaml
  jointscope discover tx90l --poses poses.csv --holdout-poses others.csv -o found.yaml
  jointscope discover tx90l --frequency frequency_P1 frequency_P3 --poses poses.csv -o found.yaml
  jointscope discover arm.yaml train.mcap --poses poses.csv --rests weights -o found.yaml

With motion alone every step is kept as a robot file of its own: found.step0.yaml, found.step1.yaml, ... The same
command continues after the last finished step; found.discovery.json remembers what it started from."""

MOST_STEPS = 12  # of robots with free links, whose sensors show one effect for each joint and gyro


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    add_bag_arguments(parser)
    parser.add_argument("-o", "--output", metavar="OUT.yaml", type=Path, required=True, help="robot file to write")
    add_workers_option(parser)
    parser.add_argument("--restart", action="store_true", help="ignore the steps of an earlier run")
    add_result_options(parser)


def run(args: argparse.Namespace) -> int:
    """Discovers, writes the files, and tells the steps."""
    from jointscope.tools.verb_parts.discovery_state import state_file, step_file

    files = ResultFiles.of(args)
    check_one_choice(args)
    check_kind(args)
    beside = [state_file(args.output), *(step_file(args.output, k) for k in range(MOST_STEPS + 1))]
    check_outputs([*files.all, *beside], inputs=input_files(args))
    load_user_effects(args.effects)
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.tools.terminal.discovery_text import discovery_text

    robot = load_robot(args.robot)
    if several_graphs(args):
        with progress_bar() as progress, workers_of(args) as workers:
            print(run_kinds_discovery(robot, args, files, workers, progress))
        files.tell()
        return 0
    if args.poses or args.frequency:
        given, held = (args.poses, args.frequency), (args.holdout_poses, args.holdout_frequency)
        with progress_bar() as progress:
            print(run_arm_search(robot, given, held, files, True, progress))
        files.tell()
        return 0
    if args.rests:
        with progress_bar() as progress:
            print(run_rest_search(robot, args.rests, args.holdout_rests, files, True, progress))
        files.tell()
        return 0
    check_viewer(robot, files)
    with progress_bar() as progress, workers_of(args) as workers:
        recordings, holdout = read_bags(args, robot, progress)
        check_workers(workers, robot, recordings)
        result = _discover(args, robot, (recordings, holdout), workers, progress)
        if files.pictures:
            progress("writing", 1.0)
        write_discovery(result, files, robot.path.name)
    print(discovery_text(result))
    files.tell()
    return 0


def _discover(
    args: argparse.Namespace,
    robot: Robot,
    given: tuple[Sequence[Any], Any],
    workers: SideBySide,
    progress: Progress,
) -> Any:
    """The computation; whatever ends it, finished steps stay on disk."""
    from jointscope.tools.notebook.calls import discover
    from jointscope.tools.notebook.results import Discovered
    from jointscope.tools.verb_parts.discovery_state import DiscoveryState, hashes_of

    recordings, holdout = given
    hashes = hashes_of(robot, recordings, holdout, args.effects)
    state = DiscoveryState(args.output, hashes, recordings, robot.path.name)
    saved = () if args.restart else state.resume()
    if saved:
        print(f"Continuing after step {len(saved) - 1}, {saved[-1].robot_file}; --restart starts anew.\n", flush=True)
    try:
        result = discover(
            robot,
            recordings,
            holdout,
            missing_torque=ResultFiles.of(args).pictures,
            save=state.save,
            resume=saved or None,
            side_by_side=workers,
            progress=progress,
        )
    except KeyboardInterrupt:
        if not state.count:
            raise
        raise JointscopeError(f"interrupted after step {state.count - 1}; the same command continues there") from None
    assert isinstance(result, Discovered)  # of motion alone
    return replace(result, robot_file=str(args.output))
