# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` and `compare` with --rests or --locked-springs, alone or with other kinds: robot file, report, JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.rests import Rests
from jointscope.tools.acceptance.evaluation import AcceptedBy
from jointscope.tools.acceptance.limits import Limit
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.frequency_runs import agreement_json, frequency_origin, kinds_json, read_all_shaken
from jointscope.tools.verb_parts.pose_runs import pose_json, pose_origin, urdf_files
from jointscope.tools.verb_parts.result_files import ResultFiles, refuse_viewer, write_found
from jointscope.tools.writing.origin import counted, made_from, other_kinds

if TYPE_CHECKING:
    from jointscope.graphs.locked_springs.coupling import Coupling


def read_all_rests(paths: Sequence[Path], robot: Robot, progress: Progress) -> list[Rests]:
    """The rests of some recordings."""
    from jointscope.tools.bags.at_poses.read_rests import read_rests

    found = []
    for i, path in enumerate(paths):
        progress(f"reading rests of {path}", i / len(paths))
        found.append(read_rests(path, robot))
    return found


def run_rest_calibration(
    robot: Robot,
    paths: Sequence[Path],
    files: ResultFiles,
    limits: Sequence[Limit],
    progress: Progress,
    coupling: Coupling | None = None,
) -> tuple[str, AcceptedBy]:
    """Calibrates from rests, beside locked springs or alone, and writes the files.

    Returns:
        What the screen says, and which limits are kept.

    Raises:
        RobotError: a viewer recording was asked for.
        JointscopeError: the rests cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.rest_search.next_rest import next_rests
    from jointscope.graphs.rests.calibrate_rests import calibrate_rests
    from jointscope.tools.report.rests_report import rests_report
    from jointscope.tools.terminal.rests_text import rest_calibration_text

    refuse_viewer(files, robot, "rests")
    beside = coupling.sets(robot) if coupling else []
    result = calibrate_rests(robot, read_all_rests(paths, robot, progress), progress, beside=beside)
    made = made_from(robot.path.name) | other_kinds(result)
    if coupling is not None:
        made |= _locked_origin(coupling)
    advice = next_rests(result)
    content = result.to_json() | coupling_json(coupling) | {"next_rests": [rest.to_json() for rest in advice]}
    page = partial(rests_report, advice=advice)
    checked = write_found(files, robot.name, result, page, made, content, limits)
    return "\n\n".join([*coupling_lines(coupling), rest_calibration_text(result, advice=advice)]), checked


def coupling_of(paths: Sequence[Path], robot: Robot) -> Coupling | None:
    """The transmission that recordings with locked springs show; None without any."""
    if not paths:
        return None
    from jointscope.tools.bags.read_locked import read_coupling

    robot.need_link_dynamics()
    return read_coupling(paths, robot)


def coupling_lines(coupling: Coupling | None) -> list[str]:
    """What the screen says of a transmission; nothing without one."""
    from jointscope.tools.terminal.coupling_text import coupling_text

    return [] if coupling is None else [coupling_text(coupling)]


def coupling_json(coupling: Coupling | None) -> dict[str, Any]:
    """The same for machines."""
    return {} if coupling is None else {"coupling": coupling.to_json()}


def _locked_origin(coupling: Coupling) -> dict[str, Any]:
    return {"locked_springs": [counted(readings) for fit in coupling.fits for readings in fit.readings]}


def run_locked_calibration(
    robot: Robot, coupling: Coupling, files: ResultFiles, limits: Sequence[Limit], progress: Progress
) -> tuple[str, AcceptedBy]:
    """Writes the transmission that locked springs alone show, and returns the screen's text and which limits are kept.

    Args:
        robot: with that transmission.
        coupling: what was found.
        files: where to.
        limits: that the user has declared.
        progress: called with a text and the share done.

    Raises:
        RobotError: a viewer recording was asked for.
        JointscopeError: a file cannot be written; then none is.
    """
    from jointscope.tools.report.locked_report import locked_report

    refuse_viewer(files, robot, "locked springs")
    progress("writing", 1.0)
    values = coupling.to_parameters()
    made = made_from(robot.path.name) | _locked_origin(coupling)
    found = replace(robot, parameters={**robot.parameters, **values})
    table = {p.name: {"value": p.value, "sigma": p.sigma, "unit": p.unit} for p in values.values()}
    content = {"converged": True, "parameters": table} | coupling_json(coupling)
    checked = write_found(files, robot.name, replace(coupling, robot=found), locked_report, made, content, limits)
    return coupling_lines(coupling)[0], checked


def run_calibration_with_rests(
    robot: Robot,
    rests: Sequence[Path],
    poses: Sequence[Path],
    shaken: Sequence[Path],
    files: ResultFiles,
    urdf: Path | None,
    limits: Sequence[Limit],
    progress: Progress,
) -> tuple[str, AcceptedBy]:
    """Calibrates from rests and other kinds, writes the files, and returns the screen's text and which limits are kept.

    Raises:
        RobotError: a viewer recording was asked for, or the robot file lacks a section.
        JointscopeError: recordings cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.joint_kinds.calibrate_with_rests import calibrate_with_rests
    from jointscope.graphs.rest_search.next_rest import next_rests
    from jointscope.tools.bags.at_poses.read_poses import read_poses
    from jointscope.tools.report.kinds_report import with_rests_report
    from jointscope.tools.terminal.poses_text import pose_calibration_text
    from jointscope.tools.terminal.responses_text import frequency_calibration_text
    from jointscope.tools.terminal.rests_text import rest_calibration_text

    refuse_viewer(files, robot, "rests")
    at_rest, sessions = read_all_rests(rests, robot, progress), [read_poses(path, robot) for path in poses]
    result = calibrate_with_rests(robot, at_rest, sessions, read_all_shaken(robot, shaken, progress), progress)
    made = made_from(robot.path.name) | other_kinds(result.rests)
    texts = []
    if result.poses is not None:
        made |= pose_origin(result.poses, robot)
        texts.append(pose_calibration_text(result.poses, beside=True))
    if result.frequency is not None:
        made |= frequency_origin(result.frequency, robot)
        texts.append(frequency_calibration_text(result.frequency, beside=True))
    advice = next_rests(result.rests)
    content, others = _with_rests_json(result), urdf_files(result.robot, urdf)
    content |= {"next_rests": [rest.to_json() for rest in advice]}
    page = partial(with_rests_report, advice=advice)
    checked = write_found(files, robot.name, result, page, made, content, limits, others)
    return "\n\n".join([_said(result), *texts, rest_calibration_text(result.rests, True, advice)]), checked


def _said(result: Any) -> str:
    """The verdict on all kinds, and what speaks against it."""
    from jointscope.tools.verdicts.with_rests_judgement import judge_with_rests

    judgement = judge_with_rests(result)
    agree = judgement.checks[0]
    return "\n".join([judgement.answer, *([f"  - {agree.text}"] if agree.level in ("good", "info") else [])])


def _with_rests_json(result: Any) -> dict[str, Any]:
    """A calibration from rests and other kinds for machines: rests have keys of their own."""
    from jointscope.tools.verdicts.with_rests_judgement import judge_with_rests

    rests, poses, frequency = result.rests.to_json(), result.poses, result.frequency
    if poses is not None and frequency is not None:
        others = kinds_json(result.others)
    else:
        others = pose_json(poses) if poses is not None else frequency.to_json()
    own = ("iterations", "samples", "parameters", "undetermined", "repeatability", "converged", "cost", "wall_seconds")
    return {
        **others,
        **{key: value for key, value in rests.items() if key not in own},
        **judge_with_rests(result).to_json(),
        "iterations": others["iterations"] + rests["iterations"],
        "samples": others["samples"] + rests["samples"],
        "parameters": others["parameters"] | rests["parameters"],
        "agreement_with_rests": agreement_json(result.agreement),
        "rest_repeatability": rests["repeatability"],
        "cost": rests["cost"],
        "wall_seconds": result.wall_seconds,
    }


def compare_rests(robots: Mapping[str, Robot], paths: Sequence[Path], progress: Progress) -> tuple[str, dict[str, Any]]:
    """Errors of some models on rests, for the screen and for JSON."""
    from jointscope.graphs.rest_sets.rest_errors import rest_errors
    from jointscope.graphs.rest_sets.rest_set import RestSet
    from jointscope.tools.terminal.rests_text import rest_errors_text

    by_label, content, count, recordings = {}, {}, 0, list[Rests]()
    for label, robot in robots.items():
        recordings = read_all_rests(paths, robot, progress)
        count = sum(map(len, recordings))
        by_label[label] = found = rest_errors([RestSet.of(robot, rests) for rests in recordings])
        content[label] = {
            "error": found.error,
            "floor": 1.0,
            "by_kind": {"rests": found.error},
            "channels": found.to_json(robot),
            "rests": {"torque_rms": found.torques(robot), "friction_beyond": found.beyond(robot)},
        }
    used = [{"kind": "rests", "path": rests.path, "sha256": rests.sha256} for rests in recordings]
    return rest_errors_text(by_label, robots, count), {"models": content, "recordings": used}
