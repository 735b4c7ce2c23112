# SPDX-License-Identifier: BSD-3-Clause
"""Measured, predicted and residual of every sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from jointscope.graphs.calibration.calibration_result import BagFit
from jointscope.tools.rerun_log.entities.columns import GREY, JOINT_COLOURS, WHITE, send_band, send_lines
from jointscope.tools.rerun_log.entities.viewer_text import entity, viewer_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb


def send_sensors(stream: rr.RecordingStream, fit: BagFit, root: str) -> None:
    """Entities residuals/SENSOR/CHANNEL and signals/SENSOR/CHANNEL below `root`."""
    for name, series in fit.residuals.items():
        for i, channel in enumerate(series.channels):
            column = slice(i, i + 1)
            measured, predicted, sigma = (x[:, column] for x in (series.measured, series.predicted, series.sigma))
            colour, t = [JOINT_COLOURS[i % len(JOINT_COLOURS)]], series.times
            residuals, signals = entity(root, "residuals", name, channel), entity(root, "signals", name, channel)
            send_lines(stream, f"{residuals}/residual", t, measured - predicted, ["residual"], colour)
            send_band(stream, f"{residuals}/band", t, 0.0 * sigma, 3.0 * sigma, [WHITE])
            send_lines(stream, f"{signals}/measured", t, measured, ["measured"], [GREY], 2.5)
            send_lines(stream, f"{signals}/predicted", t, predicted, ["predicted"], colour, 1.2)


def sensor_views(fit: BagFit, root: str, kind: str) -> rrb.Horizontal:
    """One column per sensor, one plot per channel; `kind` is "residuals" or "signals"."""
    import rerun.blueprint as rrb

    columns = [
        rrb.Vertical(
            *(
                rrb.TimeSeriesView(
                    origin="/" + entity(root, kind, name, channel),
                    name=viewer_text(f"{channel} [{unit}]"),
                    plot_legend=rrb.PlotLegend(visible=kind == "signals"),
                )
                for channel, unit in zip(series.channels, series.units, strict=True)
            ),
            name=viewer_text(name),
        )
        for name, series in fit.residuals.items()
    ]
    return rrb.Horizontal(*columns, name=kind if kind == "residuals" else "measured and predicted")
