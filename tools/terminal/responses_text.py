# SPDX-License-Identifier: BSD-3-Clause
"""Frequency responses, and an arm calibrated from them, on one screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.frequency.compare_frequency import FrequencyErrors, entries
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.graphs.responses.response_matrix import ResponseMatrix
from jointscope.robots.recordings.signals import Excitation
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.frequency_sentences import matrix_sentence, value_rows
from jointscope.tools.presentation.noisy_response import buried_lines, noise_doubt
from jointscope.tools.presentation.numbers import percent, significant, with_sigma
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.frequency_judgement import judge_frequency


def response_text(found: MeasuredResponse) -> str:
    """The summary of one recording."""
    matrix, excitation = found.matrix, found.spectra.excitation
    f = matrix.frequencies
    periods = f"{counted(len(found.spectra.U), 'experiment')} of {counted(matrix.periods, 'steady period')}"
    whole = found.distortions is not None
    apart = excitation.f0 if whole else float(np.median(np.diff(f)))
    lines = [
        f"{found.spectra.path}: {len(f)} lines from {f[0]:.6g} to {f[-1]:.6g} Hz, {apart:.6g} Hz apart; "
        + (periods if whole else f"a stretch of {1.0 / excitation.f0:.4g} s without whole periods")
        + (" (pairs of both signs)" if found.spectra.common is not None else ""),
        f"  excitation: {excitation.source}{_left_out(excitation)}; total covariance: {matrix.total_from}",
        "",
        text_table(["from", "to", "noise", "total"], entry_rows(matrix), "<<>>"),
    ]
    if found.resonances:
        lines += ["", text_table(RESONANCE_HEAD, resonance_rows(found), "<<<>>>>")]
    d = found.distortions
    if d is None:
        lines += [
            "",
            "Without whole periods noise and distortions cannot be told apart; resonances narrower than the window of "
            "the local fit come out too flat, with larger sigmas. Record two periods or more (docs/frequency.md).",
        ]
    elif not len(d.even.frequencies) + len(d.odd.frequencies):
        lines += ["", "All lines were excited, so even and odd distortions cannot be told apart."]
    lines += [part for said in (noise_doubt(found), buried_lines(found)) if said for part in ("", f"! {said}")]
    return "\n".join(lines)


def _left_out(excitation: Excitation) -> str:
    """Periods that are not used."""
    most = max(e.transient for e in excitation.experiments)
    if not most:
        return ""
    few = "the first period" if most == 1 else f"the first {most} periods"
    return f", without {few} of each experiment, in which the response had not settled"


def entry_rows(matrix: ResponseMatrix) -> list[list[str]]:
    """Each entry with its sigmas in per cent of its size, the median over lines."""
    noise = None if matrix.noise is None else matrix.relative(matrix.noise)
    total = matrix.relative(matrix.total)
    return [
        [source, target, "not told" if noise is None else percent(float(noise[i, j])), percent(float(total[i, j]))]
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


def frequency_calibration_text(result: FrequencyCalibration, beside: bool = False) -> str:
    """The summary of a calibration.

    Args:
        result: the calibration.
        beside: whether it is a part of one from several kinds, which has a verdict on all.
    """
    paths, judgement = ", ".join(problem.pose.path for problem in result.problems), judge_frequency(result)
    lines = [
        f"{result.robot.name} from {paths}: {counted(len(result.problems), 'pose')}, "
        f"calibrated in {result.wall_seconds:.1f} s, {result.iterations} iterations in {result.stages} stages",
        "",
        f"{'As far as the responses say: ' * beside}{judgement.headline}",
        *(f"  ! {check.name}? {check.text}" for check in judgement.checks if check.level in ("warn", "bad")),
        *(f"  - {check.text}" for check in judgement.checks if check.level in ("good", "info")),
        f"  - {matrix_sentence(result)}",
        "",
        text_table(["parameter", "start", "value", "± sigma", "unit", ""], value_rows(result), "<>>><<"),
    ]
    return "\n".join(lines)


ERROR_HEAD = ["model", "from", "to", "error [dB]", "floor [dB]", "error [sigma]"]
BALANCE_HEAD = ["model", "pose", "motor", "torque left", "times the noise"]


def error_rows(by_label: Mapping[str, Sequence[FrequencyErrors]]) -> list[list[str]]:
    """Each entry of each model, over lines and poses."""
    rows = []
    for label, poses in by_label.items():
        matrix = poses[0].pose.matrix
        for key, entry in entries(poses).items():
            i, j = (int(place) - 1 for place in key.split(","))
            numbers = (significant(entry[part], 2) for part in ("db", "floor_db", "sigmas"))
            rows.append([label, matrix.inputs[j], matrix.outputs[i], *numbers])
    return rows


def balance_rows(by_label: Mapping[str, Sequence[FrequencyErrors]]) -> list[list[str]]:
    """What each model leaves of each motor's torque, pose by pose."""
    rows = []
    for label, poses in by_label.items():
        for one in poses:
            for i, motor in enumerate(one.pose.matrix.inputs):
                noise = one.fit.over_noise
                times = "one period" if noise is None else significant(float(noise[i]), 2)
                rows.append([label, one.pose.path, motor, percent(float(one.fit.left[i])), times])
    return rows


def frequency_errors_text(by_label: Mapping[str, Sequence[FrequencyErrors]]) -> str:
    """A comparison of models."""
    first = next(iter(by_label.values()))
    count = sum(len(one.pose.lines) for one in first)
    lines = [
        f"{counted(len(first), 'pose')}, {counted(count, 'line')}: "
        "size of the model's matrix over the measured one, the floor that the "
        "covariance of the measured one alone would give, and the distance in its sigmas (root mean squares)",
        text_table(ERROR_HEAD, error_rows(by_label), "<<<>>>"),
        "",
        "What the torque balance, which includes dry friction, leaves, and the power of that over the noise's",
        text_table(BALANCE_HEAD, balance_rows(by_label), "<<<>>"),
    ]
    worst = [
        f"{label} is furthest off at {far[1]:.3g} Hz in {far[2]}: {significant(far[0], 2)} sigmas"
        for label, poses in by_label.items()
        for far in [max(_furthest(one) for one in poses)]
    ]
    return "\n".join([*lines, "", *(f"  - {text}" for text in worst)])


def _furthest(one: FrequencyErrors) -> tuple[float, float, str]:
    """Largest distance of a pose in sigmas, its frequency, and the path."""
    by_line = one.sigmas.max(axis=(1, 2))
    k = int(np.argmax(by_line))
    return float(by_line[k]), float(one.pose.w[k] / (2.0 * np.pi)), one.pose.path
