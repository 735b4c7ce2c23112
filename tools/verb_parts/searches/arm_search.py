# SPDX-License-Identifier: BSD-3-Clause
"""`diagnose` and `discover` with --poses, --frequency, or both: ranking, robot file, report and JSON out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.frequency_runs import frequency_origin, read_all_shaken
from jointscope.tools.verb_parts.pose_runs import pose_origin
from jointscope.tools.verb_parts.result_files import ResultFiles, write_still
from jointscope.tools.writing.origin import made_from
from jointscope.tools.writing.whole_file import write_json

Paths = Sequence[Path]


def run_arm_search(
    robot: Robot,
    given: tuple[Paths, Paths],
    holdout: tuple[Paths, Paths],
    files: ResultFiles,
    search: bool,
    progress: Progress,
) -> str:
    """Looks for effects, adds them if `search`, writes the files, and returns what the screen says.

    Args:
        robot: the model.
        given: poses, and bags of the arm shaken.
        holdout: the same that are scored and never choose.
        files: where to.
        search: whether effects are added.
        progress: called with a text and the share done.

    Raises:
        RobotError: pictures were asked for that these recordings do not have.
        JointscopeError: the recordings cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.joint_kinds.discover_arm import diagnosed, discover_arm, scored
    from jointscope.graphs.joint_kinds.likeliest_effect import calibrated
    from jointscope.tools.bags.at_poses.read_poses import read_poses
    from jointscope.tools.terminal.searches.arm_discovery_text import (
        arm_discovery_text,
        explained_sentences,
        heldout_table,
        limit_sentences,
        moved_sentences,
        ranking_text,
        recordings_said,
        told_apart,
        unseen_sentences,
    )

    if files.rrd is not None or (files.pictures and not search):
        raise RobotError(
            f"{robot.name}: poses and frequency responses have a report with `calibrate` and `discover`; leave the "
            "option out"
        )
    sessions, held = ([read_poses(path, robot) for path in paths] for paths in (given[0], holdout[0]))
    recordings, held_shaken = (read_all_shaken(robot, paths, progress) for paths in (given[1], holdout[1]))
    if not search:
        progress("calibrating", 0.0)
        result = calibrated(robot, sessions, recordings)
        progress("looking for effects", 0.9)
        candidates = diagnosed(result, sessions, recordings, progress)
        found = scored(result, candidates, held, held_shaken)
        if files.json is not None:
            ranked = [candidate_json(c) for c in candidates]
            content = {"adequate": _adequate(candidates), "moved": moved_json(result), "candidates": ranked}
            write_json(files.json, content | heldout_json(found))
        leading = [c for c in candidates if c.verdict == "missing"][:3]
        said = explained_sentences(candidates) + [line for c in leading for line in told_apart(c)]
        said += unseen_sentences(candidates, found.kinds if len(found.kinds) > 1 else ())
        said += limit_sentences(found.steps[0])
        ranking = ranking_text(candidates, recordings_said(found), found.kinds)
        said = [*moved_sentences(result), *heldout_table(found), ranking, *said]
        return "\n\n".join(said)
    found = discover_arm(robot, sessions, held, progress, recordings, held_shaken)
    write_still(files, found.robot, _origin(found, robot), partial(_page, found), _discovery(found, files.robot))
    return arm_discovery_text(found)


def moved_json(calibration: Any) -> dict[str, Any] | None:
    """What moved during a session of poses, for machines."""
    from jointscope.tools.verdicts.pose_judgement import moved_during

    step = None if calibration.poses is None else moved_during(calibration.poses)
    if step is None:
        return None
    return {name: each for name, each in asdict(step).items() if name != "mimic"} | {"text": step.text}


def candidate_json(c: Any) -> dict[str, Any]:
    """An effect for machines."""
    kind = c.hypothesis.kind
    unit = "rad/(N m)" if kind.soft else kind.unit
    names = [n.replace("stiffness", "compliance") if kind.soft else n for n in c.hypothesis.names]
    sizes = zip(names, c.sizes, c.sigmas, strict=True)
    return {
        "effect": kind.id,
        "owner": c.hypothesis.owner,
        "score": c.score,
        "dof": len(c.sizes),
        "p_value": c.p_value,
        "parameters": {name: {"value": value, "sigma": sigma, "unit": unit} for name, value, sigma in sizes},
        "gain": c.gain,
        "by_kind": {name: {"gain": gain.share, "helped": gain.helped} for name, gain in c.gains.items()},
        "shown_by": list(c.shown_by),
        "untestable_by": dict(kind.unseen),
        "look_alikes": list(c.look_alikes),
        "explained_by": c.explained_by or None,
        "look_alikes_by_kind": {name: list(labels) for name, labels in c.alone.items()},
        "verdict": c.verdict,
    }


def _page(found: Any, **options: Any) -> str:
    """The report of the last model with the steps that led to it."""
    from jointscope.tools.report.searches.arm_search_report import arm_search_report

    return arm_search_report(found, **options)


def _origin(found: Any, robot: Robot) -> dict[str, Any]:
    last, made = found.steps[-1].calibrated, made_from(robot.path.name)
    made |= {} if last.poses is None else pose_origin(last.poses, robot)
    return made | ({} if last.frequency is None else frequency_origin(last.frequency, robot))


def heldout_json(found: Any) -> dict[str, Any]:
    """Errors of a model that was diagnosed on recordings that were held out; nothing without any."""
    if not (found.holdout or found.steps[0].shaken):
        return {}
    (step,) = _discovery(found, None)["steps"]
    return {name: step[name] for name in ("train_error", "heldout_error", "floor", "by_kind", "poses")}


def _discovery(found: Any, robot_file: Path | None) -> dict[str, Any]:
    steps = []
    for step in found.steps:
        by_kind, train = {}, {}
        if step.calibrated.poses is not None:
            train["poses"] = found.whitened(step, step.result.problems)
            if found.holdout:
                by_kind["poses"] = found.whitened(step, found.holdout)
        if step.calibrated.frequency is not None:
            train["frequency"] = step.left / found.steps[-1].left
            if step.shaken:
                by_kind["frequency"] = step.left_heldout / found.steps[-1].left
        errors = {"train_error": rms(train), "heldout_error": rms(by_kind) if by_kind else None, "floor": 1.0}
        added = {"added": step.added.hypothesis.label if step.added else None, "removed": None}
        mm = {"poses": None if step.heldout is None else step.heldout.to_json()}
        torques = {} if step.calibrated.frequency is None else {"torques_left": step.left}
        seen = {"by_kind": {**train, **by_kind}, "candidates": [candidate_json(c) for c in step.candidates]}
        steps.append(added | errors | mm | torques | seen)
    last = found.steps[-1].candidates
    return {
        "steps": steps,
        "stop_reason": found.stop_reason,
        "adequate": _adequate(last),
        "moved": moved_json(found.steps[0].calibrated),
        "robot_file": None if robot_file is None else str(robot_file),
    }


def rms(by_kind: Mapping[str, float]) -> float:
    """Root mean square over kinds."""
    return float(sum(e**2 for e in by_kind.values()) / len(by_kind)) ** 0.5


def _adequate(candidates: Sequence[Any]) -> bool:
    return not any(c.verdict == "missing" for c in candidates)
