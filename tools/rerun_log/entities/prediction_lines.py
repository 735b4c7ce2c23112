# SPDX-License-Identifier: BSD-3-Clause
"""Measured against predicted, channel by channel and model by model: errors, 0.1 s ahead, and open loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointscope.graphs.comparison.comparison_result import ComparisonResult
from jointscope.tools.rerun_log.entities.columns import GREY, JOINT_COLOURS, send_lines
from jointscope.tools.rerun_log.entities.tab_contents import plot_columns, plot_view
from jointscope.tools.rerun_log.entities.viewer_text import entity

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

MODEL_COLOURS = (JOINT_COLOURS[2], JOINT_COLOURS[0], JOINT_COLOURS[1], *JOINT_COLOURS[3:])
KINDS = {"error": "error 0.1 s ahead [sigma]", "ahead": "0.1 s ahead", "open_loop": "open loop"}


def send_predictions(stream: rr.RecordingStream, result: ComparisonResult) -> None:
    """Entities KIND/CHANNEL for every kind of KINDS."""
    for sensor, prediction in (result.models[0].sensors if result.models else {}).items():
        for i in range(len(prediction.channels)):
            _send_channel(stream, result, sensor, i)


def prediction_views(result: ComparisonResult) -> list[rrb.Horizontal]:
    """One tab per kind of prediction, one plot per channel."""
    sensors = result.models[0].sensors if result.models else {}

    def view(kind: str, channel: str, unit: str) -> rrb.TimeSeriesView:
        return plot_view(channel if kind == "error" else f"{channel} [{unit}]", kind, channel)

    return [
        plot_columns(
            ([view(kind, *each) for each in zip(p.channels, p.units, strict=True)] for p in sensors.values()), title
        )
        for kind, title in KINDS.items()
    ]


def prediction_bytes(result: ComparisonResult) -> int:
    """About how much the predictions take [byte]."""
    return 8 * sum(4 * s.measured.size for model in result.models for s in model.sensors.values())


def _send_channel(stream: rr.RecordingStream, result: ComparisonResult, sensor: str, i: int) -> None:
    """Measured, and all models in one entity: they share their times, which halves the file."""
    first = result.models[0].sensors[sensor]
    models = [m for m in result.models if sensor in m.sensors and len(m.sensors[sensor].times) == len(first.times)]
    predictions = [m.sensors[sensor] for m in models]
    labels = [m.label for m in models]
    colours = [MODEL_COLOURS[result.models.index(m) % len(MODEL_COLOURS)] for m in models]
    measured, channel = first.measured[:, i : i + 1], first.channels[i]
    ahead = np.column_stack([p.ahead[:, i] for p in predictions])
    free = np.column_stack([p.open_loop[:, i] for p in predictions])
    # predictions end at some of the samples only; rows without any are left out, or the lines would fall apart
    some = np.isfinite(ahead).any(axis=1)
    for kind, values, rows in (("ahead", ahead, some), ("open_loop", free, np.ones_like(some))):
        send_lines(stream, entity(kind, channel, "measured"), first.times, measured, ["measured"], [GREY], 2.5)
        send_lines(stream, entity(kind, channel, "predicted"), first.times[rows], values[rows], labels, colours, 1.2)
    error = ((measured - ahead) / first.sigmas[i])[some]
    send_lines(stream, entity("error", channel), first.times[some], error, labels, colours)
