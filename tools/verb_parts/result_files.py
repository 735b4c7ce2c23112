# SPDX-License-Identifier: BSD-3-Clause
"""Writes what a verb found as robot file, report, rerun recording and JSON: all of them, or none."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from jointscope.robots.errors import JointscopeError, RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.outside_modules import need_module
from jointscope.tools.acceptance.evaluation import NO_LIMITS, AcceptedBy, acceptance_json, check_models
from jointscope.tools.acceptance.limits import Limit
from jointscope.tools.writing.origin import provenance, recordings_of, step_provenance
from jointscope.tools.writing.whole_file import check_outputs, whole_file, write_json


@dataclass(frozen=True)
class ResultFiles:
    """The files that the user asked for; None where not.

    Attributes:
        report: HTML.
        rrd: rerun recording.
        json: what the screen says, for machines.
        robot: robot file; only a calibration has one.
        figures: folder for every picture of the report as SVG, with the extra `plot` as PDF, too; made if it is
            not there.

    Raises:
        JointscopeError: an rrd is asked for, and rerun is not there; the folder for pictures is a file or has no place.
    """

    report: Path | None = None
    rrd: Path | None = None
    json: Path | None = None
    robot: Path | None = None
    figures: Path | None = None

    def __post_init__(self) -> None:
        if self.figures is not None and not self.figures.is_dir():
            check_outputs([self.figures])
            if self.figures.exists():
                raise JointscopeError(f"cannot write into {self.figures}: it is a file; expected a folder")
        if self.rrd is not None:
            need_module("rerun")  # now, not after an hour of work

    @classmethod
    def of(cls, args: argparse.Namespace) -> ResultFiles:
        """The files named on the command line."""
        return cls(args.report, args.rrd, args.json, getattr(args, "output", None), args.figures)

    @property
    def all(self) -> tuple[Path, ...]:
        """Those that were asked for; without the folder of pictures."""
        return tuple(path for path in (self.robot, self.report, self.rrd, self.json) if path is not None)

    def tell(self, *others: Path | None) -> None:
        """Prints what was written: these files, others, and the folder of pictures."""
        named = [str(path) for path in (*self.all, *others, self.figures) if path is not None]
        if named:
            print(f"\nWrote {', '.join(named)}")
        if self.figures is not None and not can_draw_pdf():
            print("Pictures as PDF, too: pip install 'jointscope[plot]'")

    @property
    def pictures(self) -> bool:
        """Whether anything with pictures was asked for."""
        return self.report is not None or self.rrd is not None or self.figures is not None


def can_draw_pdf() -> bool:
    """Whether the modules of the extra `plot` are there."""
    return all(find_spec(module) is not None for module in ("matplotlib", "cssselect2"))


def add_result_options(parser: argparse.ArgumentParser, viewer: bool = True) -> None:
    """Adds --report, --figures and --json, which every verb that estimates something takes, and --rrd for motion."""
    parser.add_argument("--report", type=Path, metavar="F.html", help="write a report for the browser")
    pictures = "write every picture of the report as SVG, and also as PDF if the extra `plot` is installed"
    parser.add_argument("--figures", type=Path, metavar="DIR", help=pictures)
    if viewer:
        parser.add_argument("--rrd", type=Path, metavar="F.rrd", help="write a recording for `jointscope view`")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")


def check_viewer(robot: Robot, files: ResultFiles) -> None:
    """The viewer shows states of links, which a robot with free links has not.

    Raises:
        RobotError: a viewer recording was asked for.
    """
    if robot.free_links and files.rrd is not None:
        raise RobotError(f"{robot.name}: --rrd is not available with link_dynamics: free; use --report")


def write_calibration(
    result: Any, files: ResultFiles, checked: AcceptedBy = NO_LIMITS, more: Mapping[str, Any] | None = None
) -> None:
    """Writes a CalibrationResult, and which limits it keeps; errors as of `_write`, as of all that follow."""
    from jointscope.tools.report import calibration_report
    from jointscope.tools.rerun_log import log_calibration
    from jointscope.tools.verdicts.judgement import judge

    report, said = partial(calibration_report, checked=checked), acceptance_json(checked) | dict(more or {})
    _write(result, files, report, log_calibration, lambda: judge(result).to_json() | said, provenance(result))


def write_comparison(result: Any, files: ResultFiles, checked: AcceptedBy = NO_LIMITS) -> None:
    """Writes a ComparisonResult, and which limits its models keep."""
    from jointscope.tools.report import comparison_report
    from jointscope.tools.rerun_log import log_comparison

    _write(result, files, partial(comparison_report, checked=checked), log_comparison, lambda: acceptance_json(checked))


def write_diagnosis(
    result: Any,
    files: ResultFiles,
    checked: AcceptedBy = NO_LIMITS,
    first: Sequence[Any] = (),
    content: Mapping[str, Any] | None = None,
) -> None:
    """Writes a Diagnosis, and which limits its model keeps.

    Args:
        result: what was found.
        files: where to.
        checked: limits that the user has declared, as they came out.
        first: sections of the report before all others.
        content: of the JSON, in place of what is there or beside it.

    Raises:
        JointscopeError: a file cannot be written; then none is.
    """
    from jointscope.tools.report import diagnosis_report
    from jointscope.tools.rerun_log import log_diagnosis

    report = partial(diagnosis_report, checked=checked, first=first)
    _write(result, files, report, log_diagnosis, lambda: {**(content or {})} | acceptance_json(checked))


def write_discovery(result: Any, files: ResultFiles, start: str) -> None:
    """Writes a Discovery; its last robot goes to `files.robot`, and `start` is the name of the base robot's file."""
    from jointscope.tools.report import discovery_report
    from jointscope.tools.rerun_log import log_discovery

    last = len(result.steps) - 1
    made = step_provenance(result.steps[last], last, start, result.recordings)
    _write(result, files, discovery_report, log_discovery, made=made)


def write_closed_loop(result: Any, files: ResultFiles) -> None:
    """Writes a ClosedLoopResult."""
    from jointscope.tools.report import closed_loop_report
    from jointscope.tools.rerun_log import log_closed_loop

    _write(result, files, closed_loop_report, log_closed_loop)


def write_replay(result: Any, files: ResultFiles) -> None:
    """Writes a ReplayResult."""
    from jointscope.tools.report.replay_report import replay_report
    from jointscope.tools.rerun_log.log_replay import log_replay
    from jointscope.tools.verdicts.replay_judgement import judge_replay

    _write(result, files, replay_report, log_replay, lambda: judge_replay(result).to_json())


def _write(
    result: Any,
    files: ResultFiles,
    report: Callable[[Any], str],
    log: Callable[[Any, Path], None],
    more: Callable[[], dict[str, Any]] = dict,
    made: dict[str, Any] | None = None,
) -> None:
    """Robot file of what was `made`, report, rerun recording, and JSON with `more`: all, or none.

    Raises:
        JointscopeError: a file cannot be written; then none is.
    """
    with ExitStack() as stack:
        if made is not None:
            write_robot(stack, files, result.robot, made)
        write_report(stack, files, partial(report, result))
        if files.rrd is not None:
            log(result, stack.enter_context(whole_file(files.rrd)))
        if files.json is not None:
            write_json(stack.enter_context(whole_file(files.json)), result.to_json() | more())


def refuse_viewer(files: ResultFiles, robot: Robot, what: str) -> None:
    """A viewer recording shows motion, and nothing of what was given in its place.

    Raises:
        RobotError: one was asked for.
    """
    if files.rrd is not None:
        raise RobotError(f"{robot.name}: --rrd shows motion, not {what}; use --report")


def write_still(
    files: ResultFiles,
    robot: Robot,
    made: dict[str, Any],
    report: Callable[..., str],
    content: dict[str, Any],
    others: Mapping[Path, str] | None = None,
) -> None:
    """Writes what was found without motion: robot file, report, JSON.

    Args:
        files: where to.
        robot: that was found.
        made: where its numbers come from.
        report: makes the page, and takes further sections as `more`.
        content: of the JSON; recordings with their hashes are added.
        others: texts of further files.

    Raises:
        JointscopeError: a file cannot be written; then none is.
    """
    with ExitStack() as stack:
        write_robot(stack, files, robot, made)
        for path, text in (others or {}).items():
            stack.enter_context(whole_file(path)).write_text(text, encoding="utf-8")
        from jointscope.tools.report.page.provenance import provenance_without_motion

        write_report(stack, files, lambda: report(more=[provenance_without_motion(made, robot)]))
        if files.json is not None:
            write_json(stack.enter_context(whole_file(files.json)), content | {"recordings": recordings_of(made)})


def write_found(
    files: ResultFiles,
    name: str,
    result: Any,
    report: Callable[..., str],
    made: dict[str, Any],
    content: dict[str, Any],
    limits: Sequence[Limit],
    others: Mapping[Path, str] | None = None,
) -> AcceptedBy:
    """Writes what was calibrated without motion, and returns which limits it keeps.

    Args:
        files: where to.
        name: of the robot that was calibrated.
        result: with the robot that was found.
        report: makes the page of the result and of the limits as they came out.
        made: where its numbers come from.
        content: of the JSON without limits and recordings.
        limits: that the user has declared.
        others: texts of further files.

    Raises:
        JointscopeError: a file cannot be written; then none is.
    """
    checked = check_models(limits, {name: content})
    page = partial(report, result, checked)
    write_still(files, result.robot, made, page, content | acceptance_json(checked), others)
    return checked


def write_robot(stack: ExitStack, files: ResultFiles, robot: Robot, made: dict[str, Any]) -> None:
    """The robot file, where it is asked for, and where its numbers come from; it takes its place with the others."""
    if files.robot is None:
        return
    from jointscope.robots.files.robot_writer import robot_text

    text = robot_text(robot, files.robot.parent, made)
    stack.enter_context(whole_file(files.robot)).write_text(text, encoding="utf-8")


def write_report(stack: ExitStack, files: ResultFiles, report: Callable[[], str]) -> None:
    """The report and its pictures, where they are asked for; they take their places when the stack closes."""
    if files.report is None and files.figures is None:
        return
    html = report()
    if files.report is not None:
        stack.enter_context(whole_file(files.report)).write_text(html, encoding="utf-8")
    if files.figures is not None:
        from jointscope.tools.report.page.report_figures import report_figures

        files.figures.mkdir(exist_ok=True)
        for name, svg in report_figures(html).items():
            stack.enter_context(whole_file(files.figures / name)).write_text(svg, encoding="utf-8")
            if can_draw_pdf():
                from jointscope.tools.report.pdf.pdf_picture import pdf_picture

                page = pdf_picture(svg)
                stack.enter_context(whole_file((files.figures / name).with_suffix(".pdf"))).write_bytes(page)
