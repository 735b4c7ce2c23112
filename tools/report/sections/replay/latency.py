# SPDX-License-Identifier: BSD-3-Clause
"""Wall time of the updates: over the recording, and as a distribution."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Section, figure, table
from jointscope.tools.report.page.plot import Axes, Bars, Curve, plot

BINS = 80


def latency(result: ReplayResult) -> Section:
    """A table, the series and the histogram."""
    found = result.latency
    lead = (
        "Time from handing over the messages of a tick until mean and covariance are there, on this machine. An update "
        "must be done before the next command."
    )
    cells = [[significant(1e3 * value) for value in (found.p50, found.mean, found.p99, found.max)]]
    body = table(["median [ms]", "mean [ms]", "99 of 100 [ms]", "largest [ms]"], cells, [0, 1, 2, 3])
    milliseconds = 1e3 * found.seconds
    period = 1e3 * result.recording_seconds / max(result.updates, 1)
    near = period < 3.0 * float(np.max(milliseconds, initial=0.0))
    levels = [(period, "period of the commands")] if near else []
    curve = Curve("update", found.times, milliseconds, "k2", "hair")
    low = 0.8 * float(np.min(milliseconds[milliseconds > 0.0], initial=np.inf))
    series_axes = Axes("wall time of an update [ms]", height=190, log_y=np.isfinite(low), levels=levels)
    body += figure([plot(series_axes, [curve])], group="replay")
    top = 1.15 * float(np.quantile(milliseconds, 0.995))
    edges = np.linspace(0.0, top or 1.0, BINS + 1)
    heights, _ = np.histogram(milliseconds, edges)
    axes = Axes("number of updates", "wall time [ms]", height=190, zoomable=False)
    beyond = int(np.count_nonzero(milliseconds > edges[-1]))
    caption = f"{beyond} of {len(milliseconds)} updates took longer than the axis shows." if beyond else ""
    body += figure([plot(axes, [Bars("", edges, heights.astype(float), "k2")])], caption=caption)
    return Section("latency", "Latency", body, lead)
