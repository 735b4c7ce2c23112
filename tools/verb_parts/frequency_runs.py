# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` with --frequency: shaken poses in; robot file, report and JSON out."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.tools.acceptance.evaluation import AcceptedBy, acceptance_json, check_models
from jointscope.tools.acceptance.limits import Limit
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.result_files import ResultFiles, made_from, write_still


def add_frequency_option(parser: argparse.ArgumentParser) -> None:
    """Adds --frequency."""
    parser.add_argument(
        "--frequency",
        nargs="+",
        type=Path,
        default=[],
        metavar="BAG",
        help="recordings of the arm shaken in one pose each (docs/frequency.md)",
    )


def run_frequency_calibration(
    robot: Robot, paths: Sequence[Path], files: ResultFiles, limits: Sequence[Limit], progress: Progress
) -> tuple[str, AcceptedBy]:
    """Calibrates, writes the files, and returns what the screen says, and which limits are kept.

    Raises:
        RobotError: a viewer recording was asked for, or the robot file does not say what is shaken.
        JointscopeError: the recordings cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
    from jointscope.tools.bags.read_shaken import read_shaken
    from jointscope.tools.report.frequency_report import frequency_report
    from jointscope.tools.terminal.responses_text import frequency_calibration_text

    if files.rrd is not None:
        raise RobotError(f"{robot.name}: --rrd shows motion, not frequency responses; use --report")
    recordings = []
    for i, path in enumerate(paths):
        progress(f"reading {path.name}", i / len(paths))
        recordings.append(read_shaken(path, robot))
    result = calibrate_frequency(robot, recordings, progress)
    content = result.to_json()
    checked = check_models(limits, {robot.name: content})
    page, content = partial(frequency_report, result, checked), content | acceptance_json(checked)
    write_still(files, result.robot, _origin(result, robot), page, content)
    return frequency_calibration_text(result), checked


def _origin(result: Any, start: Robot) -> dict[str, Any]:
    poses = [problem.pose for problem in result.problems]
    found = [{"path": p.path, "sha256": p.sha256, "lines": len(p.lines)} for p in poses]
    return made_from(start.path.name) | {"frequency": found}
