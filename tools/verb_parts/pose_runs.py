# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` and `compare` with --poses: poses in, robot file, URDF, report and JSON out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.recording import must_count_once
from jointscope.tools.acceptance.evaluation import AcceptedBy
from jointscope.tools.acceptance.limits import Limit
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.result_files import ResultFiles, refuse_viewer, write_found
from jointscope.tools.writing.origin import counted, made_from


def check_one_kind(
    bags: Sequence[Path],
    poses: Sequence[Path],
    rests: Sequence[Path] | None,
    options: Mapping[str, bool],
    frequency: Sequence[Path] | None = None,
    locked_springs: Sequence[Path] | None = None,
) -> None:
    """Kinds of recordings that go together, and no option of another.

    Args:
        bags: as given.
        poses: as given.
        rests: as given; None of a verb that takes none.
        options: of recordings of motion, and whether they are given.
        frequency: as given; None of a verb that takes none.
        locked_springs: as given; None of a verb that takes none.

    Raises:
        RecordingError: none, kinds that do not go together, or such an option without motion.
    """
    if not bags and not poses and not rests and not frequency and not locked_springs:
        other = "" if rests is None else ", or --rests BAG"
        other += "" if frequency is None else ", or --frequency BAG"
        other += "" if locked_springs is None else ", or --locked-springs BAG"
        raise RecordingError(
            f"nothing to calibrate from; expected BAG... before the first option, or --poses FILE{other}"
        )
    still = {"rests": rests or (), "poses": poses, "frequency responses": frequency or ()}
    still["locked springs"] = locked_springs or ()
    twice = next(((path, kind) for kind, paths in still.items() for path in bags if path in paths), None)
    if twice is not None:
        raise RecordingError(f"{twice[0]} is given as motion and as {twice[1]}; leave it out once")
    for option, paths in (("--poses", poses), ("--rests", rests or ()), ("--frequency", frequency or ())):
        given_once(option, paths)
    given = next((option for option, there in options.items() if there), None)
    if given and not bags:
        other = "--poses" if poses else "--frequency" if frequency else "--rests" if rests else "--locked-springs"
        raise RecordingError(f"{given} is for recordings of motion; leave it out with {other}")


def given_once(option: str, paths: Sequence[Path]) -> None:
    """As `must_count_once`, for recordings that are not read yet; what is not there, its reader says."""
    from jointscope.tools.bags.messages.open_bag import bag_sha256

    if len(paths) > 1:
        must_count_once(((str(path), bag_sha256(path)) for path in paths if path.exists()), option)


def run_pose_calibration(
    robot: Robot,
    paths: Sequence[Path],
    files: ResultFiles,
    urdf: Path | None,
    limits: Sequence[Limit],
    progress: Progress,
) -> tuple[str, AcceptedBy]:
    """Calibrates, writes the files, and returns what the screen says, and which limits are kept.

    Raises:
        RobotError: a viewer recording was asked for, or the URDF cannot take the errors.
        JointscopeError: the poses cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.poses.calibrate_poses import calibrate_poses
    from jointscope.tools.bags.at_poses.read_poses import read_poses
    from jointscope.tools.report.poses_report import poses_report
    from jointscope.tools.terminal.poses_text import pose_calibration_text

    refuse_viewer(files, robot, "poses")
    result = calibrate_poses(robot, [read_poses(path, robot) for path in paths], progress)
    made, others = pose_origin(result, robot), urdf_files(result.robot, urdf)
    checked = write_found(files, robot.name, result, poses_report, made, pose_json(result), limits, others)
    return pose_calibration_text(result), checked


def weighted_poses(robot: Robot, paths: Sequence[Path], progress: Progress) -> tuple[Robot, list[Any]]:
    """Poses for an estimate with motion, weighted as they repeat, and the robot with the tracker where it stands."""
    if not paths:
        return robot, []
    from jointscope.graphs.poses.calibrate_poses import calibrate_poses
    from jointscope.tools.bags.at_poses.read_poses import read_poses

    problems = calibrate_poses(robot, [read_poses(path, robot) for path in paths], progress).problems
    return problems[0].robot, list(problems)


def urdf_files(robot: Robot, urdf: Path | None) -> dict[Path, str]:
    """The URDF with the geometry that poses told, by its path, where it is asked for."""
    if urdf is None:
        return {}
    from jointscope.robots.geometry.calibrated_urdf import calibrated_urdf

    return {urdf: calibrated_urdf(robot)}


def compare_poses(robots: Mapping[str, Robot], paths: Sequence[Path]) -> tuple[str, dict[str, Any]]:
    """Errors of some models on poses, for the screen and for JSON."""
    from jointscope.graphs.poses.tip_errors import TipErrors, parts_of, summary, targets_json
    from jointscope.graphs.poses.tracker_start import placed
    from jointscope.tools.bags.at_poses.read_poses import read_poses
    from jointscope.tools.terminal.poses_text import pose_errors_text

    by_label: dict[str, dict[str, TipErrors]] = {}
    count, sessions = 0, list[Poses]()
    for label, robot in robots.items():
        sessions = [read_poses(path, robot) for path in paths]
        count = sum(map(len, sessions))
        _, problems = placed(robot, sessions)
        each = [parts_of(problem) for problem in problems]
        by_label[label] = {part: summary([found[part] for found in each]) for part in each[0]}
    content = {
        label: {
            "poses": {
                **parts["whole model"].to_json(),
                "parts": {p: e.to_json() for p, e in parts.items()},
                **targets_json(parts["whole model"]),
            }
        }
        for label, parts in by_label.items()
    }
    used = [{"kind": "poses", "path": poses.path, "sha256": poses.sha256} for poses in sessions]
    return pose_errors_text(by_label, count), {"models": content, "recordings": used}


def pose_json(result: Any) -> dict[str, Any]:
    """A calibration for machines."""
    from jointscope.graphs.poses.tip_errors import summary, targets_json
    from jointscope.tools.verdicts.pose_judgement import judge_poses

    robot = result.robot
    return {
        "converged": True,
        "iterations": result.iterations,
        "samples": result.count,
        "wall_seconds": result.wall_seconds,
        "chi2": result.chi2,
        "parameters": {
            n: {
                "value": robot.parameters[n].value,
                "sigma": robot.parameters[n].sigma,
                "unit": robot.parameters[n].unit,
            }
            for n in result.names
        },
        "told": list(result.told),
        "rank": result.determined.rank,
        "undetermined": list(result.determined.combinations),
        "repeatability": {j: float(s) for j, s in zip(robot.joints, robot.poses.joint_sigmas, strict=True)},
        "left_out": [
            {"path": each.path, "pose": each.pose, "sigmas": each.sigmas}
            | ({"target": each.target} if each.target else {})
            for each in result.left_out
        ],
        "poses": [errors.to_json() for errors in result.errors],
        "poses_before": [errors.to_json() for errors in result.before],
        **targets_json(summary(result.errors)),
        **_turn_noise(result),
        **judge_poses(result).to_json(),
    }


def _turn_noise(result: Any) -> dict[str, float]:
    """Noise of orientations [rad], where there are any."""
    turned = any(problem.targets.turns.any() for problem in result.problems)
    return {"orientation_sigma": float(result.robot.poses.turn_sigma)} if turned else {}


def pose_origin(result: Any, start: Robot) -> dict[str, Any]:
    """Where a calibration from poses comes from."""
    poses = [counted(p.poses) for p in result.problems]
    return made_from(start.path.name) | {"poses": poses}
