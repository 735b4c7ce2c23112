# SPDX-License-Identifier: BSD-3-Clause
"""Measured signals with what each model predicts, open loop and 0.1 s ahead, sensor by sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.comparison.comparison_result import ComparisonResult, SensorPrediction
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Curve, Mark
from jointscope.tools.report.sections.comparison.model_colours import model_colour, model_keys

Array = NDArray[np.float64]

LONG = 5.0  # [median distance of samples with a value]


def predictions(result: ComparisonResult) -> Section:
    """One figure per sensor and kind of prediction."""
    points = max(1500 // (1 + len(result.models)), 500)
    body = ""
    sensors = result.models[0].sensors if result.models else {}
    for name in sensors:
        body += f"<h3>{name}: 0.1 s ahead</h3>" + _sensor(result, name, "ahead", points)
        body += f"<h3>{name}: open loop from the first state</h3>" + _sensor(result, name, "open_loop", points)
    lead = (
        "Broad and pale: measured. Dashed: predicted with the recorded commands alone, 0.1 s ahead from the state "
        "known then, or open loop over the whole recording, where positions drift because nothing corrects them."
    )
    return Section("predictions", "Measured and predicted", body, lead)


def channel_marks(
    result: ComparisonResult, sensor: str, i: int, kind: str, points: int = 1500
) -> tuple[str, list[Mark]]:
    """Title and curves of one channel: measured, then every model."""
    first = result.models[0].sensors[sensor]
    marks: list[Mark] = [Curve("measured", first.times, first.measured[:, i], "soft", "wide", points)]
    for k, model in enumerate(result.models):
        if sensor in model.sensors:
            prediction = model.sensors[sensor]
            times, values = joined(prediction.times, getattr(prediction, kind)[:, i])
            marks.append(Curve(model.label, times, values, model_colour(k), "dashed", points))
    return f"{first.channels[i]} [{first.units[i]}]", marks


def _sensor(result: ComparisonResult, name: str, kind: str, points: int) -> str:
    first = result.models[0].sensors[name]
    panels = []
    for i in range(len(first.channels)):
        title, marks = channel_marks(result, name, i, kind, points)
        limits = (float(first.times[0]), float(first.times[-1]))
        panels.append((Axes(title, height=120, x_range=limits, y_range=_readable(first, i, marks)), marks))
    keys = [Key("measured", "soft", "wide"), *model_keys(result)]
    return figure(below_each_other(panels), keys, group="whole")


def _readable(sensor: SensorPrediction, i: int, marks: list[Mark]) -> tuple[float, float]:
    """Limits that follow the measurement; a prediction that runs away may leave the picture."""
    low, high = float(np.nanmin(sensor.measured[:, i])), float(np.nanmax(sensor.measured[:, i]))
    span = max(high - low, 20.0 * float(sensor.sigmas[i]))
    values = np.concatenate([m.y[np.isfinite(m.y)] for m in marks if isinstance(m, Curve)])
    return (
        max(float(values.min()), low - 0.75 * span) - 0.06 * span,
        min(float(values.max()), high + 0.75 * span) + 0.06 * span,
    )


def joined(times: Array, values: Array) -> tuple[Array, Array]:
    """The samples that have a value, interrupted only where one is missing for long.

    Args:
        times: shape (m,) [s].
        values: shape (m,); NaN where there is none.

    Returns:
        Times and values; a NaN stands in every long gap.
    """
    good = np.isfinite(values)
    t, y = times[good], values[good]
    if len(t) < 3:
        return t, y
    gaps = np.diff(t)
    after = np.flatnonzero(gaps > LONG * np.median(gaps)) + 1
    return np.insert(t, after, 0.5 * (t[after - 1] + t[after])), np.insert(y, after, np.nan)
