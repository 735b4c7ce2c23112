# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` and `compare` with --poses: poses in, robot file, URDF, report and JSON out."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.result_files import ResultFiles
from jointscope.tools.writing.whole_file import whole_file, write_json


def add_poses_option(parser: argparse.ArgumentParser) -> None:
    """Adds --poses."""
    parser.add_argument(
        "--poses",
        nargs="+",
        type=Path,
        default=[],
        metavar="TABLE-or-BAG",
        help="poses of the arm at rest with a measured target (docs/poses.md)",
    )


def run_pose_calibration(
    robot: Robot, paths: Sequence[Path], files: ResultFiles, urdf: Path | None, progress: Progress
) -> str:
    """Calibrates, writes the files, and returns what the screen says.

    Raises:
        RobotError: a viewer recording was asked for, or the URDF cannot take the errors.
        JointscopeError: the poses cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.poses.calibrate_poses import calibrate_poses
    from jointscope.tools.bags.read_poses import read_poses
    from jointscope.tools.terminal.poses_text import pose_calibration_text

    if files.rrd is not None:
        raise RobotError(f"{robot.name}: --rrd shows motion, not poses; use --report")
    result = calibrate_poses(robot, [read_poses(path, robot) for path in paths], progress)
    with ExitStack() as stack:
        if files.robot is not None:
            from jointscope.robots.files.robot_writer import robot_text

            text = robot_text(result.robot, files.robot.parent, _origin(result, robot))
            stack.enter_context(whole_file(files.robot)).write_text(text, encoding="utf-8")
        if urdf is not None:
            from jointscope.robots.geometry.calibrated_urdf import calibrated_urdf

            stack.enter_context(whole_file(urdf)).write_text(calibrated_urdf(result.robot), encoding="utf-8")
        if files.report is not None:
            from jointscope.tools.report.poses_report import poses_report

            stack.enter_context(whole_file(files.report)).write_text(poses_report(result), encoding="utf-8")
        if files.json is not None:
            write_json(stack.enter_context(whole_file(files.json)), pose_json(result))
    return pose_calibration_text(result)


def compare_poses(robots: Mapping[str, Robot], paths: Sequence[Path]) -> tuple[str, dict[str, Any]]:
    """Errors of some models on poses, for the screen and for JSON."""
    from jointscope.graphs.poses.calibrate_poses import placed
    from jointscope.graphs.poses.tip_errors import TipErrors, parts_of, summary
    from jointscope.tools.bags.read_poses import read_poses
    from jointscope.tools.terminal.poses_text import pose_errors_text

    by_label: dict[str, dict[str, TipErrors]] = {}
    count = 0
    for label, robot in robots.items():
        sessions: list[Poses] = [read_poses(path, robot) for path in paths]
        count = sum(map(len, sessions))
        _, problems = placed(robot, sessions)
        each = [parts_of(problem) for problem in problems]
        by_label[label] = {part: summary([found[part] for found in each]) for part in each[0]}
    content = {
        label: {"poses": parts["whole model"].to_json() | {"parts": {p: e.to_json() for p, e in parts.items()}}}
        for label, parts in by_label.items()
    }
    return pose_errors_text(by_label, count), {"models": content}


def pose_json(result: Any) -> dict[str, Any]:
    """A calibration for machines."""
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
        "left_out": [{"path": path, "pose": pose, "sigmas": sigmas} for path, pose, sigmas in result.left_out],
        "poses": [errors.to_json() for errors in result.errors],
        "poses_before": [errors.to_json() for errors in result.before],
    }


def _origin(result: Any, start: Robot) -> dict[str, Any]:
    from datetime import UTC, datetime

    import jointscope

    return {
        "version": jointscope.__version__,
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "start": start.path.name,
        "poses": [{"path": p.poses.path, "sha256": p.poses.sha256, "count": len(p.poses)} for p in result.problems],
    }
