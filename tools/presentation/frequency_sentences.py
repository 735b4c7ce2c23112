# SPDX-License-Identifier: BSD-3-Clause
"""What is said of a calibration from frequency responses: fit of the matrix, what is not identifiable, values."""

from __future__ import annotations

from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.tools.presentation.numbers import significant, with_sigma


def matrix_sentence(result: FrequencyCalibration) -> str:
    """How well the model's matrix fits."""
    now, before = result.rms_log(result.robot)["rms_log"], result.rms_log(result.start)["rms_log"]
    return (
        f"logarithm of the response matrix, model over measured: {significant(now, 2)} rms, {significant(before, 2)} "
        "before; dry friction, which the torque balance knows, makes most of what is left"
    )


def identifiable_sentence(result: FrequencyCalibration) -> str:
    """What these poses do not tell."""
    if not result.silent:
        return "all springs and dampers are identifiable"
    return f"not identifiable from these poses: {', '.join(result.silent)}"


def one_realisation(result: FrequencyCalibration) -> list[str]:
    """Where a covariance rests on one realisation."""
    alone = [p.pose.path for p in result.problems if len(p.pose.matrix.each) == 1]
    text = "what friction does under other phases is taken from neighbouring lines; record more to know it"
    return [f"{path} has one realisation: {text}" for path in alone]


def value_rows(result: FrequencyCalibration) -> list[list[str]]:
    """Springs, dampers, friction and geometric errors that are told, and springs that are not."""
    rows = []
    for name in result.names:
        if name not in result.told and name not in result.silent:
            continue
        p, start = result.robot.parameters[name], result.start.parameters[name].value
        value, sigma = with_sigma(p.value, p.sigma or 0.0)
        note = "not identifiable" if name in result.silent else ""
        rows.append([name, significant(start, 4), value, sigma, p.unit, note])
    return rows
