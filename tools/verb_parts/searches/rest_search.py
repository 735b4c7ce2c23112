# SPDX-License-Identifier: BSD-3-Clause
"""`diagnose` and `discover` with --rests: ranking, steps, robot file, report and JSON out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from jointscope.robots.model.robot import Robot
from jointscope.tools.terminal.progress import Progress
from jointscope.tools.verb_parts.rest_runs import read_all_rests
from jointscope.tools.verb_parts.result_files import ResultFiles, refuse_viewer, write_still
from jointscope.tools.writing.origin import made_from, other_kinds

KIND = "rests"


def run_rest_search(
    robot: Robot, given: Sequence[Path], holdout: Sequence[Path], files: ResultFiles, search: bool, progress: Progress
) -> str:
    """Looks for effects, adds them if `search`, writes the files, and returns what the screen says.

    Args:
        robot: the model.
        given: bags with rests.
        holdout: the same that are scored and never choose.
        files: where to.
        search: whether effects are added.
        progress: called with a text and the share done.

    Raises:
        RobotError: a viewer recording was asked for.
        JointscopeError: the rests cannot be used, or a file cannot be written; then none is.
    """
    from jointscope.graphs.rest_search.discover_rests import diagnose_rests, discover_rests
    from jointscope.tools.report.searches.rest_search_report import rest_search_report
    from jointscope.tools.terminal.searches.rest_search_text import rest_search_text

    refuse_viewer(files, robot, "rests")
    recordings, held = (read_all_rests(paths, robot, progress) for paths in (given, holdout))
    if search:
        found = discover_rests(robot, recordings, held, progress)
        content = discovery_json(found, files.robot)
    else:
        found = diagnose_rests(robot, recordings, held, progress)
        content = diagnosis_json(found)
    made = made_from(robot.path.name) | other_kinds(found.steps[-1].result)
    write_still(files, found.robot, made, partial(rest_search_report, found), content)
    return rest_search_text(found)


def diagnosis_json(found: Any) -> dict[str, Any]:
    """The content of `--json` of a diagnosis."""
    candidates = [candidate_json(c, _measured(found)) for c in found.candidates]
    return {"adequate": found.adequate, **_errors(found, -1), "candidates": candidates}


def discovery_json(found: Any, robot_file: Path | None) -> dict[str, Any]:
    """The content of `--json` of a discovery."""
    steps = [
        {
            "added": None if step.added is None else step.added.label,
            "removed": None,
            **_errors(found, k),
            "candidates": [candidate_json(c, _measured(found)) for c in step.judged.candidates],
        }
        for k, step in enumerate(found.steps)
    ]
    return {
        "steps": steps,
        "stop_reason": found.stop_reason,
        "adequate": found.adequate,
        "robot_file": None if robot_file is None else str(robot_file),
    }


def candidate_json(c: Any, measured: int) -> dict[str, Any]:
    """An effect for machines.

    Args:
        c: the candidate.
        measured: number of measured values, for the share of squared errors that a gain would be worth.
    """
    effect, _, owner = c.label.partition("@")
    gain = None if c.gains is None else 1.0 - float(np.exp(-2.0 * c.gain / measured))
    judged = {} if gain is None else {KIND: {"gain": gain, "helped": c.helped, "log_likelihood": c.gain}}
    return {
        "effect": effect,
        "owner": owner,
        "score": c.score,
        "dof": c.dof,
        "p_value": c.p_value,
        "parameters": {
            n: {"value": value, "sigma": sigma, "unit": unit} for n, (value, sigma, unit) in c.sizes.items()
        },
        "gain": gain,
        "by_kind": judged,
        "shown_by": [KIND] if c.verdict == "missing" else [],
        "untestable_by": {KIND: c.why} if c.verdict == "untestable" else {},
        "look_alikes": list(c.look_alikes),
        "verdict": c.verdict,
    }


def _errors(found: Any, k: int) -> dict[str, Any]:
    """Errors of the model of step k."""
    train, held = found.errors_of_steps[k]
    torques = {"train": train.torques(found.robot), "heldout": None if held is None else held.torques(found.robot)}
    return {
        "train_error": train.error,
        "heldout_error": None if held is None else held.error,
        "floor": 1.0,
        "by_kind": {KIND: train.error if held is None else held.error},
        "missing_torque": torques,
    }


def _measured(found: Any) -> int:
    return sum(problem.measured for problem in found.steps[-1].result.problems)
