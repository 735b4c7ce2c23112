# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` with --frequency, alone or with --poses: shaken poses in; robot file, report and JSON out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.signals import Excitation, Signals
from jointscope.tools.acceptance.evaluation import AcceptedBy, acceptance_json, check_models
from jointscope.tools.acceptance.limits import Limit
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.pose_runs import pose_json, pose_origin, urdf_files
from jointscope.tools.verb_parts.result_files import ResultFiles, refuse_viewer, write_found, write_report
from jointscope.tools.writing.origin import made_from
from jointscope.tools.writing.whole_file import whole_file, write_json


def run_frequency_calibration(
    robot: Robot, paths: Sequence[Path], files: ResultFiles, limits: Sequence[Limit], progress: Progress
) -> tuple[str, AcceptedBy]:
    """Calibrates, writes the files, and returns what the screen says, and which limits are kept.

    Raises:
        RobotError: a viewer recording was asked for, or the robot file does not say what is shaken.
        JointscopeError: the recordings cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
    from jointscope.graphs.joint_kinds.arm_candidates import Calibrated
    from jointscope.tools.report.frequency_report import frequency_report
    from jointscope.tools.terminal.responses_text import frequency_calibration_text
    from jointscope.tools.verdicts.frequency_judgement import judge_frequency

    refuse_viewer(files, robot, "frequency responses")
    result = calibrate_frequency(robot, read_all_shaken(robot, paths, progress), progress)
    lacks = _lacking(Calibrated(None, result), progress)
    content = result.to_json() | judge_frequency(result).to_json() | lacks[1]
    made = frequency_origin(result, robot)
    checked = write_found(files, robot.name, result, frequency_report, made, content, limits)
    return "\n\n".join([frequency_calibration_text(result), *lacks[0]]), checked


def _lacking(result: Any, progress: Progress) -> tuple[list[str], dict[str, Any]]:
    """What the model lacks where a response is left over, for the screen and for JSON."""
    from jointscope.tools.verdicts.missing_in_arm import missing_in_arm, missing_sentence

    progress("looking for what is missing", 1.0)
    missing = missing_in_arm(result)
    if not missing:
        return [], {}
    return [missing_sentence(missing)], {"missing": [c.hypothesis.label for c in missing]}


def read_all_shaken(robot: Robot, paths: Sequence[Path], progress: Progress) -> list[tuple[Signals, Excitation]]:
    """The recordings of all poses in which the arm was shaken."""
    from jointscope.tools.bags.at_poses.read_shaken import read_shaken

    recordings = []
    for i, path in enumerate(paths):
        progress(f"reading {path.name}", i / len(paths))
        recordings.append(read_shaken(path, robot))
    return recordings


def run_frequency_comparison(
    robots: Mapping[str, Robot], paths: Sequence[Path], files: ResultFiles, limits: Sequence[Limit], progress: Progress
) -> tuple[str, AcceptedBy]:
    """Compares models, writes the files, and returns what the screen says, and which limits are kept.

    Args:
        robots: by their labels; each has a section `frequency`.
        paths: of the bags.
        files: without a viewer recording.
        limits: that the user has declared.
        progress: called with a text and the share done.

    Raises:
        RobotError: a viewer recording was asked for, or models shake other motors.
        JointscopeError: the recordings cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.frequency.compare_frequency import errors_json, frequency_errors
    from jointscope.tools.report.frequency_comparison_report import frequency_comparison_report
    from jointscope.tools.terminal.responses_text import frequency_errors_text

    if files.rrd is not None:
        raise RobotError("--rrd shows motion, not frequency responses; use --report")
    by_label = {}
    for label, robot in robots.items():
        recordings = read_all_shaken(robot, paths, progress)
        progress(f"comparing {label}", 1.0)
        by_label[label] = frequency_errors(robot, recordings)
    _check_motors(robots)
    models = {label: {"frequency": errors_json(poses)} for label, poses in by_label.items()}
    used = [{"kind": "frequency", "path": one.pose.path, "sha256": one.pose.sha256} for one in by_label[label]]
    checked = check_models(limits, models)
    with ExitStack() as stack:
        write_report(stack, files, lambda: frequency_comparison_report(by_label, checked))
        if files.json is not None:
            content = {"models": models, "recordings": used} | acceptance_json(checked)
            write_json(stack.enter_context(whole_file(files.json)), content)
    return frequency_errors_text(by_label), checked


def _check_motors(robots: Mapping[str, Robot]) -> None:
    shaken = {label: robot.frequency.joints for label, robot in robots.items() if robot.frequency is not None}
    (first, joints), *others = shaken.items()
    other = next((label for label, names in others if names != joints), None)
    if other is not None:
        raise RobotError(f"{other} shakes {', '.join(shaken[other])}, {first} {', '.join(joints)}; compare them apart")


def frequency_origin(result: Any, start: Robot) -> dict[str, Any]:
    """Where a calibration from frequency responses comes from."""
    poses = [problem.pose for problem in result.problems]
    found = [{"path": p.path, "sha256": p.sha256, "lines": len(p.lines)} for p in poses]
    return made_from(start.path.name) | {"frequency": found}


def run_kinds_calibration(
    robot: Robot,
    bags: Sequence[Path],
    poses: Sequence[Path],
    files: ResultFiles,
    urdf: Path | None,
    limits: Sequence[Limit],
    progress: Progress,
) -> tuple[str, AcceptedBy]:
    """Calibrates, writes the files, and returns what the screen says, and which limits are kept.

    Raises:
        RobotError: a viewer recording was asked for, or the robot file lacks a section.
        JointscopeError: recordings or poses cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.joint_kinds.arm_candidates import Calibrated
    from jointscope.graphs.joint_kinds.calibrate_kinds import calibrate_kinds
    from jointscope.tools.bags.at_poses.read_poses import read_poses
    from jointscope.tools.presentation.frequency_sentences import kinds_sentences
    from jointscope.tools.report.kinds_report import kinds_report
    from jointscope.tools.terminal.poses_text import pose_calibration_text
    from jointscope.tools.terminal.responses_text import frequency_calibration_text
    from jointscope.tools.verdicts.frequency_judgement import judge_kinds

    refuse_viewer(files, robot, "poses or frequency responses")
    sessions = [read_poses(path, robot) for path in poses]
    result = calibrate_kinds(robot, read_all_shaken(robot, bags, progress), sessions, progress)
    lacks = _lacking(Calibrated(result.poses, result.frequency), progress)
    content = kinds_json(result) | lacks[1]
    made = pose_origin(result.poses, robot) | frequency_origin(result.frequency, robot)
    others = urdf_files(result.robot, urdf)
    checked = write_found(files, robot.name, result, kinds_report, made, content, limits, others)
    judgement = judge_kinds(result)
    agree = "\n".join(f"  - {sentence}" for sentence in kinds_sentences(result))
    texts = [
        pose_calibration_text(result.poses, beside=True),
        frequency_calibration_text(result.frequency, beside=True),
    ]
    return "\n\n".join([f"{judgement.headline}\n{agree}", *lacks[0], *texts]), checked


def kinds_json(result: Any) -> dict[str, Any]:
    """A calibration from poses and frequency responses for machines."""
    from jointscope.tools.verdicts.frequency_judgement import judge_kinds

    responses, (alone, joint) = result.frequency.to_json(), result.pose_squares
    return responses | pose_json(result.poses) | judge_kinds(result).to_json() | {
        "iterations": result.frequency.iterations + result.poses.iterations,
        "samples": responses["samples"] + result.poses.count,
        "wall_seconds": result.wall_seconds,
        "undetermined": [*result.poses.determined.combinations, *({n: 1.0} for n in sorted(result.frequency.silent))],
        "agreement": agreement_json(result.agreement)
        | {"squares": {"poses_alone": alone, "poses": joint, "frequency": result.frequency_squares}},
    }  # fmt: skip


def agreement_json(found: Any) -> dict[str, Any]:
    """Whether kinds tell the same."""
    return {"chi2": found.chi2, "dof": found.dof, "p_value": found.p_value}
