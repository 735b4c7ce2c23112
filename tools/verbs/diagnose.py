# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope diagnose`: ranks the physical effects that a model lacks, each with its evidence."""

from __future__ import annotations

import argparse

from jointscope.robots.errors import RobotError
from jointscope.tools.terminal.progress import progress_bar
from jointscope.tools.verb_parts.acceptance import add_accept_option, limits_of, print_acceptance
from jointscope.tools.verb_parts.bag_arguments import add_bag_arguments, check_kind, input_files, read_bags
from jointscope.tools.verb_parts.result_files import ResultFiles, add_result_options, check_viewer
from jointscope.tools.verb_parts.searches.arm_search import run_arm_search
from jointscope.tools.verb_parts.searches.kinds_search import run_kinds_diagnosis, several_graphs
from jointscope.tools.verb_parts.searches.rest_search import run_rest_search
from jointscope.tools.verb_parts.user_effects import load_user_effects
from jointscope.tools.verb_parts.workers import add_workers_option, check_one_choice, check_workers, workers_of
from jointscope.tools.writing.whole_file import check_outputs

DESCRIPTION = "Shows where a model fails and ranks the physical effects that it may lack."
EXAMPLE = """example:
  jointscope diagnose doggy train.mcap --holdout test.mcap --report diagnosis.html
  jointscope diagnose biorob --rests spring1 spring2 gravity --report diagnosis.html
  jointscope diagnose tx90l --frequency frequency_P1 frequency_P3 --poses poses.csv
  jointscope diagnose arm.yaml train.mcap --poses poses.csv --rests weights --report diagnosis.html

The robot is calibrated first. Effects are chosen on blocks of the training recordings that were left out; the held-out
recording is only scored. `jointscope add` puts an effect into the robot file, `jointscope discover` repeats both."""
ARM_LIMITS = (
    "--accept: limits do not apply to a diagnosis of poses or frequency responses; `jointscope calibrate` and "
    "`jointscope compare` take them with --poses and --frequency"
)

REST_LIMITS = (
    "--accept: limits do not apply to a diagnosis of rests; `jointscope calibrate` and `jointscope compare` "
    "take them with --rests"
)

KINDS_LIMITS = (
    "--accept: limits do not apply to a diagnosis of several kinds; `jointscope calibrate` takes them with all"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    add_bag_arguments(parser)
    add_workers_option(parser)
    add_accept_option(parser)
    add_result_options(parser)


def run(args: argparse.Namespace) -> int:
    """Diagnoses, writes the files, and says what was found."""
    files = ResultFiles.of(args)
    check_one_choice(args)
    check_kind(args)
    check_outputs(files.all, inputs=input_files(args))
    load_user_effects(args.effects)
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.tools.notebook.calls import diagnose
    from jointscope.tools.notebook.results import Diagnosed
    from jointscope.tools.terminal.diagnosis_text import diagnosis_text

    robot = load_robot(args.robot)
    limits = limits_of(args, [robot])
    if several_graphs(args):
        if limits:
            raise RobotError(KINDS_LIMITS)
        check_viewer(robot, files)
        with progress_bar() as progress, workers_of(args) as workers:
            print(run_kinds_diagnosis(robot, args, files, workers, progress))
        files.tell()
        return 0
    if args.poses or args.frequency:
        if limits:
            raise RobotError(ARM_LIMITS)
        given, held = (args.poses, args.frequency), (args.holdout_poses, args.holdout_frequency)
        with progress_bar() as progress:
            print(run_arm_search(robot, given, held, files, False, progress))
        files.tell()
        return 0
    if args.rests:
        if limits:
            raise RobotError(REST_LIMITS)
        with progress_bar() as progress:
            print(run_rest_search(robot, args.rests, args.holdout_rests, files, False, progress))
        files.tell()
        return 0
    check_viewer(robot, files)
    with progress_bar() as progress, workers_of(args) as workers:
        recordings, holdout = read_bags(args, robot, progress)
        check_workers(workers, robot, recordings)
        result = diagnose(
            robot,
            recordings,
            holdout,
            missing_torque=files.pictures,
            accept=limits,
            side_by_side=workers,
            progress=progress,
        )
        assert isinstance(result, Diagnosed)  # of motion alone
        if files.pictures:
            progress("writing", 1.0)
        result.write(files)
    print(diagnosis_text(result))
    files.tell()
    return print_acceptance(result.acceptance)
