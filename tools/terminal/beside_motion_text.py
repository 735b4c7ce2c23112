# SPDX-License-Identifier: BSD-3-Clause
"""What poses and frequency responses say of a calibration with motion, on the screen."""

from __future__ import annotations

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.frequency.explained import pose_fit
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.numbers import percent
from jointscope.tools.presentation.tip_numbers import tip_cells, tip_head
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.same_values import same_values

SIZES = ("mean", "p90", "max")


def poses_beside_motion(result: CalibrationResult) -> str:
    """How far targets are from where the model has them; empty without poses."""
    problems = [problem.of_robot(result.robot) for problem, *_ in result.sets if isinstance(problem, PoseSet)]
    if not problems:
        return ""
    errors = [tip_errors(problem) for problem in problems]
    shown = tip_head(max(errors, key=lambda each: len(each.turns)), SIZES)
    rows = []
    for problem, each in zip(problems, errors, strict=True):
        cells = tip_cells(each, SIZES)
        cells += [""] * (len(shown) - len(cells))
        rows.append([problem.poses.path, str(len(problem.poses)), *cells])
    return text_table(["poses in the same estimate", "number", *shown], rows, "<>" + ">" * len(shown))


def responses_beside_motion(result: CalibrationResult) -> str:
    """What the torque balance leaves, and whether both kinds agree; empty without frequency responses."""
    problems = [p for s, *_ in result.sets if isinstance(s, FrequencySummary) for p in s.problems]
    if not problems:
        return ""
    at = Calibration.of(result.robot).only([DYNAMICS])
    left = max(float(pose_fit(problem.of_robot(result.robot), at).left.max()) for problem in problems)
    lines = [
        f"{counted(len(problems), 'pose')} that {'was' if len(problems) == 1 else 'were'} shaken in the same estimate: "
        f"the balance leaves up to {percent(left)} of a motor's torque.",
        *(f"  {text}" for _, _, text in same_values(result)),
    ]
    return "\n".join(lines)
