# SPDX-License-Identifier: BSD-3-Clause
"""A calibration on one screen: verdict, findings, parameters with sigmas, weak directions, fit per channel, time."""

from __future__ import annotations

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.calibration.findings import AS_STATED
from jointscope.tools.presentation.numbers import prefixed, significant, with_sigma
from jointscope.tools.terminal.beside_motion_text import poses_beside_motion, responses_beside_motion
from jointscope.tools.terminal.rests_text import rests_beside_motion
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.judgement import Judgement, judge

SHOWN_FINDINGS = 6  # the report has them all
SHOWN_DIRECTIONS = 3


def calibration_text(result: CalibrationResult, judgement: Judgement | None = None) -> str:
    """The summary of a calibration for the terminal, with its judgement where that is known."""
    parts = [
        _headline(result),
        _verdict(result, judgement or judge(result)),
        _parameters(result),
        _weak_directions(result),
        _channels(result),
        rests_beside_motion(result),
        poses_beside_motion(result),
        responses_beside_motion(result),
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
