# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` and `discover` for robots with link_dynamics: free: the same options, other equations."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack

from jointscope.graphs.transmission.transmission_result import TransmissionDiscovery
from jointscope.graphs.transmission.transmission_search import MOST_STEPS, discover_transmission
from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.report.transmission_report import transmission_report
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.terminal.transmission_text import transmission_text
from jointscope.tools.verb_parts.result_files import ResultFiles, origin
from jointscope.tools.writing.whole_file import whole_file, write_json


def run_free_links(
    robot: Robot,
    recordings: Sequence[Recording],
    holdout: Recording | None,
    files: ResultFiles,
    search: bool,
    progress: Progress,
) -> str:
    """Fits the robot, with a search for missing effects or as it is, writes the files, returns what the screen says.

    Raises:
        RobotError: a viewer recording was asked for.
        JointscopeError: a file cannot be written; then none is.
    """
    if files.rrd is not None:
        raise RobotError(f"{robot.name}: --rrd is not available with link_dynamics: free; use --report")
    result = discover_transmission(robot, recordings, holdout, MOST_STEPS if search else 0, progress)
    _write(result, files, robot.path.name)
    return transmission_text(result)


def _write(result: TransmissionDiscovery, files: ResultFiles, start: str) -> None:
    with ExitStack() as stack:
        if files.robot is not None:
            text = robot_text(result.robot, files.robot.parent, origin(start, result.recordings))
            stack.enter_context(whole_file(files.robot)).write_text(text, encoding="utf-8")
        if files.report is not None:
            stack.enter_context(whole_file(files.report)).write_text(transmission_report(result), encoding="utf-8")
        if files.json is not None:
            write_json(stack.enter_context(whole_file(files.json)), result.to_json() | {"robot_file": str(files.robot)})
