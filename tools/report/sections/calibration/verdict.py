# SPDX-License-Identifier: BSD-3-Clause
"""The answer to "is this calibration good?" in words and numbers."""

from __future__ import annotations

from html import escape

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.parts.relative_sigma import relative_sigma
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Section, foldable, sentence
from jointscope.tools.verdicts.judgement import Check, judge, largest_relative_sigma

SIGNS = {"good": "✓", "info": "i", "warn": "!", "bad": "✕"}
FINDINGS = 5  # more than these go below a fold


def verdict(result: CalibrationResult) -> Section:
    """Verdict box: headline, big numbers, findings of the calibration, checks."""
    judgement = judge(result)
    findings = [f"<li>{escape(sentence(text))}</li>" for text in result.findings]
    told = f'<ul class="findings">{"".join(findings[:FINDINGS])}</ul>' if findings else ""
    if len(findings) > FINDINGS:
        rest = f'<ul class="findings">{"".join(findings[FINDINGS:])}</ul>'
        told += foldable(f"{len(findings) - FINDINGS} more findings", rest)
    checks = "".join(check_line(check) for check in judgement.checks)
    body = (
        f'<div class="verdict {judgement.level}"><p class="answer">{escape(judgement.headline)}</p>'
        f'{_big_numbers(result)}{told}<ul class="checks">{checks}</ul></div>'
    )
    return Section("verdict", "Is this calibration good?", body)


def check_line(check: Check) -> str:
    """A check as an entry of the list."""
    return (
        f'<li class="{check.level}"><i aria-label="{check.level}">{SIGNS[check.level]}</i>'
        f"<b>{escape(check.name)}</b><span>{escape(sentence(check.text))}</span></li>"
    )


def _big_numbers(result: CalibrationResult) -> str:
    name, share = largest_relative_sigma(result)
    chi2 = [fit.chi2 for fit in result.channels.values()]
    costs = [record.cost for record in result.iterations if record.stage == result.iterations[-1].stage]
    start = f"cost {significant(costs[0])} → {significant(costs[-1])} in {len(costs)} steps" if costs else ""
    figures = [
        (significant(float(np.mean(chi2))) if chi2 else "—", "mean χ² per sample over all channels; 1 is expected"),
        (relative_sigma(share, "±") if name else "—", f"least certain dynamic parameter: {name}"),
        (f"{result.samples:,}".replace(",", " "), f"samples in {significant(result.recording_seconds)} s of recording"),
        (f"{significant(result.wall_seconds)} <small>s</small>", f"to calibrate; {start}"),
    ]
    return (
        '<div class="figures">'
        + "".join(f"<div><b>{number}</b><span>{escape(text)}</span></div>" for number, text in figures)
        + "</div>"
    )
