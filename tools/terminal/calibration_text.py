# SPDX-License-Identifier: BSD-3-Clause
"""A calibration on one screen: verdict, findings, parameters with sigmas, weak directions, fit per channel, time."""

from __future__ import annotations

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.calibration.findings import AS_STATED
from jointscope.graphs.frequency.explained import pose_fit
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.numbers import percent, prefixed, significant, with_sigma
from jointscope.tools.presentation.tip_numbers import tip_cells, tip_head
from jointscope.tools.terminal.rests_text import rests_beside_motion
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.judgement import Judgement, judge
from jointscope.tools.verdicts.same_values import same_values

SHOWN_FINDINGS = 6  # the report has them all
SHOWN_DIRECTIONS = 3
SIZES = ("mean", "p90", "max")


def calibration_text(result: CalibrationResult, judgement: Judgement | None = None) -> str:
    """The summary of a calibration for the terminal, with its judgement where that is known."""
    parts = [
        _headline(result),
        _verdict(result, judgement or judge(result)),
        _parameters(result),
        _weak_directions(result),
        _channels(result),
        rests_beside_motion(result),
        _poses_beside_motion(result),
        _responses_beside_motion(result),
    ]
    return "\n\n".join(part for part in parts if part)


def _headline(result: CalibrationResult) -> str:
    bags = ", ".join(bag.recording.path for bag in result.bags)
    speed = result.recording_seconds / result.wall_seconds if result.wall_seconds > 0 else float("inf")
    return (
        f"{result.robot.name} from {bags}: {result.samples:,} samples in {result.recording_seconds:.1f} s, calibrated "
        f"in {result.wall_seconds:.1f} s ({significant(speed, 2)} times as fast as recorded), "
        f"{len(result.iterations)} iterations"
    )


def _verdict(result: CalibrationResult, judgement: Judgement) -> str:
    lines = [judgement.answer]
    told_below = {direction.text for direction in result.weak_directions}
    if judgement.level == "bad":
        told_below.add(AS_STATED)
    findings = [f"  - {finding}" for finding in result.findings if finding not in told_below]
    lines += findings[:SHOWN_FINDINGS]
    if len(findings) > SHOWN_FINDINGS:
        lines.append(f"  - and {len(findings) - SHOWN_FINDINGS} more in the report")
    return "\n".join(lines)


def _parameters(result: CalibrationResult) -> str:
    with_source = any(p.published is not None for p in result.parameters)
    head = ["parameter", "start", "value", "± sigma", "unit", *(["published"] if with_source else []), ""]
    rows = [_row(parameter, with_source) for parameter in (*result.parameters, *result.derived)]
    return text_table(head, rows, "<>>><" + (">" if with_source else "") + "<")


def _row(parameter: ParameterEstimate, with_source: bool) -> list[str]:
    value, sigma = with_sigma(parameter.value, parameter.sigma)
    published = "" if parameter.published is None else f"{parameter.published:g}"
    start = significant(parameter.start, 4)
    return [parameter.name, start, value, sigma, parameter.unit, *([published] if with_source else []), parameter.note]


def _weak_directions(result: CalibrationResult) -> str:
    if not result.weak_directions:
        return "Every combination of parameters is determined by the motion."
    lines = [f"  - {direction.text}" for direction in result.weak_directions[:SHOWN_DIRECTIONS]]
    more = len(result.weak_directions) - SHOWN_DIRECTIONS
    return "\n".join(["Weakly determined:", *lines, *([f"  - and {more} more in the report"] if more > 0 else [])])


def _channels(result: CalibrationResult) -> str:
    rows = []
    for name, fit in result.channels.items():
        factor, unit = prefixed(max(fit.rmse, fit.sigma), fit.unit)
        rows.append([name, significant(factor * fit.rmse), significant(factor * fit.sigma), unit, f"{fit.chi2:.2f}"])
    return text_table(["channel", "rms error", "sensor sigma", "unit", "chi2 (1 is expected)"], rows, "<>><>")


def _poses_beside_motion(result: CalibrationResult) -> str:
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


def _responses_beside_motion(result: CalibrationResult) -> str:
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
