# SPDX-License-Identifier: BSD-3-Clause
"""Measured, predicted and residual of every sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointscope.graphs.calibration_result import BagFit
from jointscope.tools.rerun_log.columns import GREY, JOINT_COLOURS, send_band, send_lines
from jointscope.tools.rerun_log.viewer_text import entity, viewer_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb


def send_sensors(stream: rr.RecordingStream, fit: BagFit, root: str) -> None:
    """Entities residuals/SENSOR and signals/SENSOR below `root`."""
    for name, series in fit.residuals.items():
        residual = series.measured - series.predicted
        colours = [JOINT_COLOURS[i % 6] for i in range(len(series.channels))]
        channels = [f"{channel} [{series.unit}]" for channel in series.channels]
        send_lines(stream, entity(root, "residuals", name, "residual"), series.times, residual, channels, colours)
        zero = np.zeros_like(residual)
        send_band(
            stream, entity(root, "residuals", name, "band"), series.times, zero, 3.0 * series.sigma, series.channels, colours
        )
        measured = [f"{channel} measured" for channel in series.channels]
        send_lines(
            stream, entity(root, "signals", name, "measured"), series.times, series.measured, measured, [GREY] * len(colours), 2.5
        )
        predicted = [f"{channel} predicted" for channel in series.channels]
        send_lines(stream, entity(root, "signals", name, "predicted"), series.times, series.predicted, predicted, colours, 1.2)


def sensor_views(fit: BagFit, root: str, kind: str) -> rrb.Vertical:
    """One plot per sensor below each other; `kind` is "residuals" or "signals"."""
    import rerun.blueprint as rrb

    return rrb.Vertical(
        *(
            rrb.TimeSeriesView(origin="/" + entity(root, kind, name), name=viewer_text(f"{name} [{series.unit}]"))
            for name, series in fit.residuals.items()
        ),
        name=kind if kind == "residuals" else "measured and predicted",
    )
