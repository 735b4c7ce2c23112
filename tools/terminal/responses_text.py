# SPDX-License-Identifier: BSD-3-Clause
"""Frequency responses, and an arm calibrated from them, on one screen."""

from __future__ import annotations

from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.graphs.responses.response_matrix import ResponseMatrix
from jointscope.tools.presentation.frequency_sentences import matrix_sentence, value_rows
from jointscope.tools.presentation.numbers import percent, with_sigma
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.frequency_judgement import judge_frequency


def response_text(found: MeasuredResponse) -> str:
    """The summary of one recording."""
    matrix, excitation = found.matrix, found.spectra.excitation
    f = matrix.frequencies
    lines = [
        f"{found.spectra.path}: {len(f)} lines from {f[0]:g} to {f[-1]:g} Hz, {excitation.f0:.6g} Hz apart; "
        f"{len(found.spectra.U)} experiments of {matrix.periods} steady periods"
        + (" (pairs of both signs)" if found.spectra.common is not None else ""),
        f"  excitation: {excitation.source}; total covariance: {matrix.total_from}",
        "",
        text_table(["from", "to", "noise", "total"], entry_rows(matrix), "<<>>"),
    ]
    if found.resonances:
        lines += ["", text_table(RESONANCE_HEAD, resonance_rows(found), "<<<>>>>")]
    even, odd = len(found.distortions.even.frequencies), len(found.distortions.odd.frequencies)
    if not even + odd:
        lines += ["", "All lines were excited, so even and odd distortions cannot be told apart."]
    return "\n".join(lines)


def entry_rows(matrix: ResponseMatrix) -> list[list[str]]:
    """Each entry with its sigmas in per cent of its size, the median over lines."""
    noise = None if matrix.noise is None else matrix.relative(matrix.noise)
    total = matrix.relative(matrix.total)
    return [
        [source, target, "one period" if noise is None else percent(float(noise[i, j])), percent(float(total[i, j]))]
        for i, target in enumerate(matrix.outputs)
        for j, source in enumerate(matrix.inputs)
    ]


RESONANCE_HEAD = ["", "from", "to", "frequency [Hz]", "± sigma", "damping", "± sigma"]


def resonance_rows(found: MeasuredResponse) -> list[list[str]]:
    """Resonances and anti-resonances."""
    rows = []
    for r in found.resonances:
        kind = "anti-resonance" if r.anti else "resonance"
        names = found.matrix.inputs[r.input], found.matrix.outputs[r.output]
        rows.append(
            [kind, *names, *with_sigma(r.frequency, r.frequency_sigma), *with_sigma(r.damping, r.damping_sigma)]
        )
    return rows


def frequency_calibration_text(result: FrequencyCalibration) -> str:
    """The summary of a calibration."""
    paths, judgement = ", ".join(problem.pose.path for problem in result.problems), judge_frequency(result)
    lines = [
        f"{result.robot.name} from {paths}: {len(result.problems)} poses, calibrated in {result.wall_seconds:.1f} s, "
        f"{result.iterations} iterations in {result.stages} stages",
        "",
        judgement.headline,
        *(f"  ! {check.name}? {check.text}" for check in judgement.checks if check.level in ("warn", "bad")),
        *(f"  - {check.text}" for check in judgement.checks if check.level in ("good", "info")),
        f"  - {matrix_sentence(result)}",
        "",
        text_table(["parameter", "start", "value", "± sigma", "unit", ""], value_rows(result), "<>>><<"),
    ]
    return "\n".join(lines)
