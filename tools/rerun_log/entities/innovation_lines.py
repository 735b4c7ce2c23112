# SPDX-License-Identifier: BSD-3-Clause
"""Innovations of every channel with the +-3 sigma that the filter expects, and the NIS with chi-square bounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointscope.graphs.fixed_lag.replay.nis_windows import NisWindows
from jointscope.graphs.fixed_lag.replay.replay_result import InnovationSeries
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.report.sections.replay.innovations import reach
from jointscope.tools.rerun_log.entities.columns import GREY, JOINT_COLOURS, WHITE, send_band, send_lines, time_column
from jointscope.tools.rerun_log.entities.tab_contents import plot_columns, plot_view
from jointscope.tools.rerun_log.entities.viewer_text import entity

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

Innovations = dict[str, InnovationSeries]

LIVE_REACH = 8.0  # [sigma of the sensor] of an axis before the residuals are known


def send_innovations(stream: rr.RecordingStream, innovations: Innovations) -> None:
    """Entities residuals/SENSOR/CHANNEL/residual, /outlier and /band."""
    import rerun as rr

    for name, series in innovations.items():
        for j, channel in enumerate(series.channels):
            path, colour = entity("residuals", name, channel), JOINT_COLOURS[j % len(JOINT_COLOURS)]
            residual, sigma, t = series.residual[:, j : j + 1], series.sigma[:, j : j + 1], series.times
            kept = np.where(series.used[:, None], residual, np.nan)
            send_lines(stream, f"{path}/residual", t, kept, ["residual"], [colour])
            send_band(stream, f"{path}/band", t, 0.0 * sigma, 3.0 * sigma, [WHITE])
            if not np.all(series.used):
                style = rr.SeriesPoints(names=["left out"], colors=[(235, 60, 60)], markers=["cross"], marker_sizes=[5])
                stream.log(f"{path}/outlier", style, static=True)
                out = ~series.used
                columns = rr.Scalars.columns(scalars=np.ascontiguousarray(residual[out, 0]))
                stream.send_columns(f"{path}/outlier", [time_column(t[out])], columns)


def send_nis(stream: rr.RecordingStream, innovations: Innovations) -> None:
    """Entities nis/SENSOR/value, /channels and /bounds."""
    for name, series in innovations.items():
        windows = NisWindows.of(series)
        path, t = entity("nis", name), windows.times
        colours = [JOINT_COLOURS[j % len(JOINT_COLOURS)] for j in range(len(series.channels))]
        bounds = np.column_stack([windows.low, windows.high])
        send_lines(stream, f"{path}/bounds", t, bounds, ["99.9 % low", "99.9 % high"], [GREY] * 2, 1.0)
        send_lines(stream, f"{path}/channels", t, windows.channels, series.channels, colours, 0.8)
        send_lines(stream, f"{path}/value", t, windows.sensor[:, None], [name], [WHITE], 2.2)


def innovation_views(robot: Robot, innovations: Innovations | None = None) -> rrb.Horizontal:
    """One column per sensor, one plot per channel; known innovations say how far each axis must reach."""

    def view(name: str, sensor: Sensor, j: int) -> rrb.TimeSeriesView:
        channel, reach = sensor.channels[j], _range(sensor, (innovations or {}).get(name), j)
        return plot_view(f"{channel} [{sensor.units[j]}]", "residuals", name, channel, legend=False, reach=reach)

    sensors = robot.sensors
    columns = [[view(name, sensor, j) for j in range(len(sensor.channels))] for name, sensor in sensors.items()]
    return plot_columns(columns, "residuals", list(sensors))


def nis_views(robot: Robot, legend: bool = True) -> rrb.Vertical:
    """One plot per sensor."""
    import rerun.blueprint as rrb

    title = "NIS per degree of freedom, 1 expected"
    return rrb.Vertical(
        *(plot_view(f"{sensor}: {title}", "nis", sensor, legend=legend) for sensor in robot.sensors), name="NIS"
    )


def _range(sensor: Sensor, series: InnovationSeries | None, j: int) -> tuple[float, float]:
    """Limits of an axis: the usual band and nearly all residuals; the first sigmas are far larger."""
    far = LIVE_REACH * float(sensor.sigmas[j]) if series is None or not np.any(series.used) else reach(series, j)
    return -far, far
