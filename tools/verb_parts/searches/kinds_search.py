# SPDX-License-Identifier: BSD-3-Clause
"""`diagnose` with several kinds of recordings: one ranking of all effects, and what each kind says of each."""

from __future__ import annotations

import argparse
from typing import Any

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.model.robot import Robot
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.bag_arguments import read_bags
from jointscope.tools.verb_parts.frequency_runs import read_all_shaken
from jointscope.tools.verb_parts.rest_runs import read_all_rests
from jointscope.tools.verb_parts.result_files import ResultFiles, write_diagnosis
from jointscope.tools.verb_parts.searches import arm_search, rest_search
from jointscope.tools.verb_parts.workers import check_workers
from jointscope.tools.writing.whole_file import write_json


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
    from jointscope.tools.bags.at_poses.read_poses import read_poses
    from jointscope.tools.report.searches.kinds_section import kinds_section
    from jointscope.tools.terminal.searches.kinds_text import kinds_text

    if not args.bags and (files.pictures or files.rrd is not None):
        raise RobotError(
            f"{robot.name}: without motion, `diagnose` of several kinds has text and --json; leave the option out"
        )
    recordings, holdout = read_bags(args, robot, progress) if args.bags else ([], None)
    check_workers(workers, robot, recordings)
    found = diagnose_kinds(
        robot,
        recordings,
        holdout,
        [read_poses(path, robot) for path in args.poses],
        read_all_shaken(robot, args.frequency, progress),
        read_all_rests(args.rests, robot, progress),
        read_all_rests(args.holdout_rests, robot, progress),
        progress,
        missing_torque=files.pictures,
        side_by_side=workers,
    )
    content = kinds_json(found)
    if found.motion is not None:
        write_diagnosis(found.motion, files, first=[kinds_section(found)], content=content)
    elif files.json is not None:
        write_json(files.json, content)
    return kinds_text(found)


def must_be_searched_apart(args: argparse.Namespace) -> None:
    """`discover` adds what one graph says.

    Raises:
        RecordingError: kinds that have graphs of their own.
    """
    if several_graphs(args):
        raise RecordingError(
            "`discover` grows a model by motion, by rests, or by --poses and --frequency; `jointscope diagnose` takes "
            "all of them and says which kind shows what is missing: discover with that kind, and give the robot file "
            "that it writes to `jointscope calibrate` with all of them"
        )


def kinds_json(found: Any) -> dict[str, Any]:
    """The ranking over all kinds for machines, and the candidates of each kind."""
    by_graph: dict[str, Any] = {}
    if found.motion is not None:
        by_graph["motion"] = found.motion.to_json()
    if found.arm:
        by_graph["arm"] = {
            "moved": None if found.arm_base is None else arm_search.moved_json(found.arm_base),
            "candidates": [arm_search.candidate_json(c) for c in found.arm],
        }
    if found.rests is not None:
        by_graph["rests"] = rest_search.diagnosis_json(found.rests)
    return {"adequate": found.adequate, "candidates": [_effect(c) for c in found.candidates], "by_graph": by_graph}


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
