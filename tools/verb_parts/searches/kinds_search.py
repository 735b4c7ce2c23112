# SPDX-License-Identifier: BSD-3-Clause
"""`diagnose` and `discover` with several kinds of recordings: what each kind says of each effect, and one model."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.model.robot import Robot
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.bag_arguments import read_bags
from jointscope.tools.verb_parts.frequency_runs import read_all_shaken
from jointscope.tools.verb_parts.rest_runs import read_all_rests
from jointscope.tools.verb_parts.result_files import ResultFiles, write_diagnosis, write_still
from jointscope.tools.verb_parts.searches import arm_search, rest_search
from jointscope.tools.verb_parts.workers import check_workers
from jointscope.tools.writing.origin import counted, made_from, origin
from jointscope.tools.writing.whole_file import write_json

if TYPE_CHECKING:
    from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings

FREQUENCY, RESTS = "frequency", "rests"


def several_graphs(args: argparse.Namespace) -> bool:
    """Whether recordings are given that are judged in graphs of their own: motion, rests, and all others."""
    return sum(bool(each) for each in (args.bags, args.rests, args.poses or args.frequency)) > 1


def run_kinds_diagnosis(
    robot: Robot, args: argparse.Namespace, files: ResultFiles, workers: Any, progress: Progress
) -> str:
    """Asks each kind, writes the files, and returns what the screen says.

    Args:
        robot: the model.
        args: of the verb.
        files: where to.
        workers: who fits the candidates of the motion.
        progress: called with a text and the share done.

    Raises:
        RobotError: pictures were asked for, and there is no motion.
        JointscopeError: the recordings cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.across_kinds.diagnose_kinds import diagnose_kinds
    from jointscope.graphs.joint_kinds.discover_arm import scored
    from jointscope.tools.terminal.searches.kinds_text import kinds_text

    _must_have_motion(bool(args.bags), robot, files)
    given, held = _read(robot, args, workers, progress)
    found = diagnose_kinds(robot, given, held, progress, missing_torque=files.pictures, side_by_side=workers)
    arm = None if found.arm_base is None else scored(found.arm_base, found.arm, held.poses, held.shaken)
    write_kinds_diagnosis(found, arm, files)
    return kinds_text(found, arm)


def _must_have_motion(moving: bool, robot: Robot, files: ResultFiles) -> None:
    if not moving and (files.pictures or files.rrd is not None):
        raise RobotError(
            f"{robot.name}: without motion, `diagnose` of several kinds has text and --json; leave the option out"
        )


def write_kinds_diagnosis(found: Any, arm: Any, files: ResultFiles) -> None:
    """Writes the report of the motion with the ranking over all kinds first, and JSON.

    Args:
        found: the diagnosis.
        arm: its poses and frequency responses with their errors on those held out; None without.
        files: where to.

    Raises:
        RobotError: pictures were asked for, and there is no motion.
        JointscopeError: a file cannot be written; then none is.
    """
    from jointscope.tools.report.searches.kinds_section import kinds_section

    _must_have_motion(found.motion is not None, found.robot, files)
    content = kinds_json(found, arm)
    if found.motion is not None:
        write_diagnosis(found.motion, files, first=[kinds_section(found)], content=content)
    elif files.json is not None:
        write_json(files.json, content)


def run_kinds_discovery(
    robot: Robot, args: argparse.Namespace, files: ResultFiles, workers: Any, progress: Progress
) -> str:
    """Grows one model by all kinds, writes the files, and returns what the screen says; arguments as above.

    Raises:
        RobotError: a viewer recording was asked for.
        JointscopeError: the recordings cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.across_kinds.discover_kinds import discover_kinds
    from jointscope.tools.terminal.searches.kinds_discovery_text import kinds_discovery_text

    _refuse_viewer(robot, files)
    if args.restart:
        raise RecordingError("--restart: a search over several kinds keeps no steps on disk; leave it out")
    given, held = _read(robot, args, workers, progress)
    found = discover_kinds(robot, given, held, progress, missing_torque=False, side_by_side=workers)
    write_kinds_discovery(found, files)
    return kinds_discovery_text(found)


def _refuse_viewer(robot: Robot, files: ResultFiles) -> None:
    if files.rrd is not None:
        raise RobotError(f"{robot.name}: --rrd shows motion alone; leave it out where several kinds are searched")


def write_kinds_discovery(found: Any, files: ResultFiles) -> None:
    """Writes the robot file of the last step, report and JSON.

    Raises:
        RobotError: a viewer recording was asked for.
        JointscopeError: a file cannot be written; then none is.
    """
    from jointscope.tools.report.searches.kinds_search_report import kinds_search_report

    _refuse_viewer(found.robot, files)
    began, given = found.steps[0].model.robot.path.name, found.given
    made = origin(began, given.motion) if given.motion else made_from(began)
    made |= _still_origin(given)
    write_still(files, found.robot, made, partial(kinds_search_report, found), discovery_json(found, files.robot))


def _read(
    robot: Robot, args: argparse.Namespace, workers: Any, progress: Progress
) -> tuple[KindsRecordings, KindsRecordings]:
    """What the arguments name, for training and held out."""
    from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
    from jointscope.tools.bags.at_poses.read_poses import read_poses

    must_have_sections(robot, bool(args.bags or args.rests), bool(args.poses), bool(args.frequency))
    motion, holdout = read_bags(args, robot, progress) if args.bags else ([], None)
    check_workers(workers, robot, motion)

    def still(poses: Sequence[Path], shaken: Sequence[Path], rests: Sequence[Path]) -> dict[str, Any]:
        return {
            "poses": tuple(read_poses(path, robot) for path in poses),
            "shaken": tuple(read_all_shaken(robot, shaken, progress)),
            "rests": tuple(read_all_rests(rests, robot, progress)),
        }

    given = KindsRecordings(tuple(motion), **still(args.poses, args.frequency, args.rests))
    others = still(args.holdout_poses, args.holdout_frequency, args.holdout_rests)
    return given, KindsRecordings(() if holdout is None else (holdout,), **others)


def must_have_sections(robot: Robot, moving: bool, posed: bool, shaken: bool) -> None:
    """What the robot file must say of the kinds that are given, before hours are read.

    Args:
        robot: the model.
        moving: whether there are motion or rests.
        posed: whether there are poses.
        shaken: whether there are frequency responses.

    Raises:
        RobotError: a section is missing, or the links have no equations.
    """
    from jointscope.robots.files.sections.frequency_section import no_frequency
    from jointscope.robots.files.sections.pose_section import no_poses

    if moving:
        robot.need_link_dynamics()
    if shaken and robot.frequency is None:
        raise RobotError(no_frequency(robot))
    if posed and robot.poses is None:
        raise RobotError(no_poses(robot))


def _still_origin(given: KindsRecordings) -> dict[str, Any]:
    """Recordings without motion, as the origin of a result has them."""
    still: dict[str, Sequence[Any]] = {"rests": given.rests, "poses": given.poses}
    found: dict[str, Any] = {kind: [counted(one) for one in each] for kind, each in still.items() if each}
    shaken = [{"path": signals.path, "sha256": signals.sha256} for signals, _ in given.shaken]
    return found | ({"frequency": shaken} if shaken else {})


def kinds_json(found: Any, arm: Any = None) -> dict[str, Any]:
    """The ranking over all kinds for machines, and the candidates of each kind.

    Args:
        found: the diagnosis.
        arm: its poses and frequency responses with their errors on those held out; None without.
    """
    by_graph: dict[str, Any] = {}
    if found.motion is not None:
        by_graph["motion"] = found.motion.to_json()
    if found.arm:
        by_graph["arm"] = {
            "moved": None if found.arm_base is None else arm_search.moved_json(found.arm_base),
            "candidates": [arm_search.candidate_json(c) for c in found.arm],
        } | ({} if arm is None else arm_search.heldout_json(arm))
    if found.rests is not None:
        by_graph["rests"] = rest_search.diagnosis_json(found.rests)
    return {"adequate": found.adequate, "candidates": [_effect(c) for c in found.candidates], "by_graph": by_graph}


def discovery_json(found: Any, robot_file: Path | None) -> dict[str, Any]:
    """All steps for machines: errors of each in sigmas of the last model's noise.

    Torques that responses leave have no sigma: what the last model leaves of those for training counts as one. Of rests
    of motors alone the error is a part of the friction, and its floor is zero.
    """
    left = found.errors[-1][0].get(FREQUENCY, 1.0)
    of_band = bool(found.given.rests) and found.given.rests[0].q_link is None
    steps = []
    for step, errors in zip(found.steps, found.errors, strict=True):
        own, held = ({k: e / left if k == FREQUENCY else e for k, e in each.items()} for each in errors)
        floor = {kind: 0.0 if of_band and kind == RESTS else 1.0 for kind in own}
        c = step.added
        steps.append(
            {
                "added": None if c is None else c.label,
                "removed": step.removed or None,
                "train_error": arm_search.rms(own),
                "heldout_error": arm_search.rms(held) if held else None,
                "floor": arm_search.rms(floor),
                "by_kind": {**own, **held},
                "train_by_kind": own,
                "heldout_by_kind": held,
                "effect": None if c is None else _effect(c),
                "candidates": [_effect(each) for each in step.found.candidates],
            }
        )
    return {
        "steps": steps,
        "stop_reason": found.stop_reason,
        "adequate": found.adequate,
        "robot_file": None if robot_file is None else str(robot_file),
    }


def _effect(c: Any) -> dict[str, Any]:
    effect, _, owner = c.label.partition("@")
    by_kind = {
        kind: {
            "verdict": said.verdict,
            "parameters": {n: {"value": v, "sigma": s, "unit": unit} for n, (v, s, unit) in said.sizes.items()},
            "look_alikes": list(said.look_alikes),
        }
        for kind, said in c.by_kind.items()
    }
    return {
        "effect": effect,
        "owner": owner,
        "verdict": c.verdict,
        "shown_by": list(c.shown_by),
        "against": list(c.against),
        "untestable_by": {kind: said.why for kind, said in c.by_kind.items() if said.verdict == "untestable"},
        "explained_by": c.explained_by or None,
        "look_alikes": list(c.look_alikes),
        "told_apart_by": {kind: list(labels) for kind, labels in c.told_apart.items()},
        "by_kind": by_kind,
    }
