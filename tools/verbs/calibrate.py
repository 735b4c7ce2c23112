# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope calibrate`: calibrates a robot from recordings; OUT.yaml is a robot file with sigmas and provenance."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointscope.robots.errors import RecordingError, SolveError
from jointscope.tools.acceptance.evaluation import AcceptedBy
from jointscope.tools.acceptance.limits import Limit
from jointscope.tools.presentation.left_out import add_leave_out_option, leave_out, recording_arguments
from jointscope.tools.terminal.progress import Progress, progress_bar, reading
from jointscope.tools.verb_parts.acceptance import add_accept_option, limits_of, print_acceptance
from jointscope.tools.verb_parts.bag_arguments import add_kind_options, add_locked_option
from jointscope.tools.verb_parts.frequency_runs import (
    run_frequency_calibration,
    run_kinds_calibration,
)
from jointscope.tools.verb_parts.pose_runs import check_one_kind, run_pose_calibration, urdf_files
from jointscope.tools.verb_parts.rest_runs import (
    coupling_json,
    coupling_lines,
    coupling_of,
    run_calibration_with_rests,
    run_locked_calibration,
    run_rest_calibration,
)
from jointscope.tools.verb_parts.result_files import ResultFiles, add_result_options, check_viewer
from jointscope.tools.verb_parts.user_effects import add_effects_option, effects_words, load_user_effects
from jointscope.tools.verb_parts.workers import add_spreading_option, check_one_choice, check_workers, workers_of
from jointscope.tools.writing.whole_file import check_outputs, whole_file

if TYPE_CHECKING:
    from jointscope.graphs.locked_springs.coupling import Coupling
    from jointscope.robots.model.robot import Robot

DESCRIPTION = "Finds the parameters of a robot from recordings, with their uncertainties."
EXAMPLE = """example:
  jointscope calibrate doggy calibration.mcap -o doggy_calibrated.yaml --report report.html --rrd run.rrd
  jointscope calibrate tx90l --poses poses.csv -o arm.yaml --urdf arm.urdf --report arm.html
  jointscope calibrate tx90l --frequency frequency_P1 frequency_P3 -o arm.yaml --report arm.html
  jointscope calibrate tx90l --frequency frequency_P1 frequency_P3 --poses poses -o arm.yaml --report arm.html
  jointscope calibrate biorob train --rests spring1 spring2 gravity -o arm.yaml --report arm.html
  jointscope calibrate arm.yaml --rests weights --poses poses -o arm_calibrated.yaml --report arm.html
  jointscope calibrate arm.yaml train --locked-springs bench -o arm_calibrated.yaml
  jointscope calibrate arm.yaml train --frequency frequency_P1 frequency_P3 --poses poses -o arm_calibrated.yaml

Several bags share all parameters; each has its own states and gyro biases. The result is a robot file that every verb
takes as ROBOT."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument("bags", metavar="BAG", nargs="*", type=Path, help=".bag, .mcap, .db3 or a ROS 2 bag folder")
    parser.add_argument("-o", "--output", metavar="OUT.yaml", type=Path, required=True, help="robot file to write")
    parser.add_argument(
        "--solver",
        choices=("condensed", "samples"),
        default="condensed",
        help="condensed (default): a factor for every thousand samples; samples: one for each, with GTSAM's own "
        "optimizer, the slow reference for a second or two of recording",
    )
    parser.add_argument(
        "--incremental",
        action="store_true",
        help="solve stretch after stretch with iSAM2 and print what is known after each; the end result is the same",
    )
    add_spreading_option(parser)
    add_kind_options(parser)
    add_locked_option(parser)
    parser.add_argument("--urdf", type=Path, metavar="F.urdf", help="write the URDF with the geometry found from poses")
    add_accept_option(parser)
    add_leave_out_option(parser)
    add_effects_option(parser)
    add_result_options(parser)


def run(args: argparse.Namespace) -> int:
    """Calibrates, writes the files, and says what was found."""
    _check_solvers(args)
    files = ResultFiles.of(args)
    check_one_choice(args)
    _check_kinds(args)
    check_outputs(
        [*files.all, *filter(None, [args.urdf])],
        inputs=[*args.bags, *args.poses, *args.rests, *args.frequency, *args.locked_springs, *args.effects],
    )
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.robots.model.command_words import bag_arguments
    from jointscope.tools.bags.read_motion import read_motion
    from jointscope.tools.notebook.calls import calibrate
    from jointscope.tools.terminal.calibration_text import calibration_text
    from jointscope.tools.verb_parts.first_look import first_look
    from jointscope.tools.verdicts.judgement import judge

    load_user_effects(args.effects)
    robot = load_robot(args.robot)
    limits = limits_of(args, [robot])
    coupling = coupling_of(args.locked_springs, robot)
    robot = robot if coupling is None else coupling.of_robot()
    still = _still_kinds(args, robot, files, limits, coupling)
    if still is not None:
        with progress_bar() as progress:
            text, checked = still(progress)
        print(text)
        files.tell(args.urdf)
        return print_acceptance(checked)
    check_viewer(robot, files)
    if robot.free_links and (args.incremental or args.solver != "condensed"):
        raise SolveError(
            f"{robot.name}: its links are free, so there are no states to estimate one by one; leave out "
            f"`{'--incremental' if args.incremental else '--solver samples'}`"
        )
    with progress_bar() as progress, workers_of(args) as workers:
        read = [read_motion(bag, robot, reading(bag, progress)) for bag in args.bags]
        recordings = leave_out(read, args.leave_out)
        first_look(robot, recordings)
        check_workers(workers, robot, recordings)
        seen = None if args.incremental else progress  # what is printed and a bar would write into each other
        solver = _solver(args, robot) or workers.solver
        kinds = {"rests": args.rests, "poses": args.poses, "frequency": args.frequency}
        sets = coupling.sets(robot) if coupling else []
        result = calibrate(robot, recordings, **kinds, sets=sets, accept=limits, solver=solver, progress=seen)
        if files.pictures:
            progress("writing", 1.0)
        result.write(files, coupling_json(coupling))
        for path, content in urdf_files(result.robot, args.urdf).items():
            with whole_file(path) as written:
                written.write_text(content, encoding="utf-8")
    judgement = judge(result)
    print("\n\n".join([*coupling_lines(coupling), calibration_text(result, judgement)]))
    files.tell(args.urdf)
    if judgement.level != "good":
        beside = [f"--{kind} {bag_arguments(paths)}" for kind, paths in kinds.items() if paths]
        words = [bag_arguments([args.output]), recording_arguments(recordings), *beside, *effects_words(args.effects)]
        print(f"What it may lack: jointscope diagnose {' '.join(words)} --report diagnosis.html")
    return print_acceptance(result.acceptance)


def _still_kinds(
    args: argparse.Namespace, robot: Robot, files: ResultFiles, limits: Sequence[Limit], coupling: Coupling | None
) -> Callable[[Progress], tuple[str, AcceptedBy]] | None:
    """What calibrates from poses, frequency responses, rests or locked springs; None where there is motion."""
    if args.bags:
        return None
    if coupling is not None and not (args.rests or args.poses or args.frequency):
        return partial(run_locked_calibration, robot, coupling, files, limits)
    if args.rests and (args.poses or args.frequency):
        kinds = (args.rests, args.poses, args.frequency)
        return partial(run_calibration_with_rests, robot, *kinds, files, args.urdf, limits)
    if args.poses and args.frequency:
        return partial(run_kinds_calibration, robot, args.frequency, args.poses, files, args.urdf, limits)
    if args.poses:
        return partial(run_pose_calibration, robot, args.poses, files, args.urdf, limits)
    if not (args.rests or args.frequency):
        return None
    if args.rests:
        return partial(run_rest_calibration, robot, args.rests, files, limits, coupling=coupling)
    return partial(run_frequency_calibration, robot, args.frequency, files, limits)


def _check_solvers(args: argparse.Namespace) -> None:
    """Solvers that go together.

    Raises:
        SolveError: two of them.
    """
    if args.incremental and args.solver == "samples":
        raise SolveError("--incremental goes over condensed factors; leave out `--solver samples`")
    if (args.incremental or args.solver == "samples") and (args.workers > 1 or args.scheduler is not None):
        raise SolveError(
            f"{'--incremental' if args.incremental else '--solver samples'} solves in this process alone; leave out "
            "--workers and --scheduler"
        )


def _check_kinds(args: argparse.Namespace) -> None:
    """One kind of recording, and what goes with it.

    Raises:
        RecordingError: none, both, or an option of the other kind.
    """
    of_motion = {
        "--incremental": args.incremental,
        "--solver samples": args.solver == "samples",
        "--leave-out": bool(args.leave_out),
        "--scheduler": args.scheduler is not None,
        "--workers": args.workers > 1,
    }
    if args.locked_springs and not args.bags and (args.poses or args.frequency):
        option = "--poses" if args.poses else "--frequency"
        raise RecordingError(
            f"--locked-springs goes alone, with recordings of motion, or with --rests alone; without motion leave "
            f"{option} out: calibrate the transmission first, then take the file that was written"
        )
    check_one_kind(args.bags, args.poses, args.rests, of_motion, args.frequency, args.locked_springs)
    sample_by_sample = next((option for option in ("--incremental", "--solver samples") if of_motion[option]), None)
    others = {"--poses": args.poses, "--rests": args.rests, "--frequency": args.frequency}
    others["--locked-springs"] = args.locked_springs
    beside = next((option for option, paths in others.items() if paths), None)
    if sample_by_sample and beside:
        raise RecordingError(
            f"{sample_by_sample} goes along motion alone, and {beside} has none; leave {sample_by_sample} out, and the "
            "batch takes all kinds in one graph"
        )
    if args.urdf is not None and not args.poses:
        raise RecordingError("--urdf writes the geometry found from poses; give --poses, too")


def _solver(args: argparse.Namespace, robot: Any) -> Any:
    """What minimises the cost of all samples, if it is not the batch."""
    if args.incremental:
        from jointscope.graphs.gtsam_solvers.incremental_solver import Incremental
        from jointscope.tools.terminal.known_so_far import known_so_far_text

        units = {parameter.name: parameter.unit for parameter in robot.parameters.values()}

        def say(text: str) -> None:
            print(text, end="\n\n", flush=True)

        return Incremental(lambda known: say(known_so_far_text(known, units)), say)
    if args.solver == "samples":
        from jointscope.graphs.gtsam_solvers.samples_solver import solve_samples

        return solve_samples
    return None
