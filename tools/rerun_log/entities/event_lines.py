# SPDX-License-Identifier: BSD-3-Clause
"""Events of the estimator as a text log, and the wall time of its updates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.messages.event import Event
from jointscope.tools.rerun_log.entities.columns import WHITE, send_lines, time_column
from jointscope.tools.rerun_log.entities.viewer_text import viewer_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

LEVELS = {
    "alarm": "ERROR",
    "restarted": "ERROR",
    "sensor_lost": "WARN",
    "command_lost": "WARN",
    "stuck": "WARN",
    "saturated": "WARN",
    "outlier": "WARN",
    "not_finite": "WARN",
    "too_late": "WARN",
    "gap": "WARN",
    "late": "DEBUG",
    "duplicate": "DEBUG",
}


def send_events(stream: rr.RecordingStream, events: Sequence[Event]) -> None:
    """Entity events."""
    import rerun as rr

    if events:
        times = time_column(np.array([event.time for event in events]))
        texts = [viewer_text(event.text) for event in events]
        levels = [LEVELS.get(event.kind, "INFO") for event in events]
        stream.send_columns("events", [times], rr.TextLog.columns(text=texts, level=levels))


def send_latency(
    stream: rr.RecordingStream, times: NDArray[np.float64], seconds: NDArray[np.float64], histogram: bool = True
) -> None:
    """Entities latency/update [ms] and latency_histogram (updates per 10 us)."""
    import rerun as rr

    send_lines(stream, "latency/update", times, 1e3 * seconds[:, None], ["update [ms]"], [WHITE])
    if histogram and len(seconds):
        top = float(np.quantile(seconds, 0.999)) * 1.2
        counts, _ = np.histogram(np.minimum(seconds, top), bins=np.arange(0.0, top + 2e-5, 1e-5))
        stream.log("latency_histogram", rr.BarChart(counts), static=True)


def event_view() -> rrb.TextLogView:
    """The text log."""
    import rerun.blueprint as rrb

    return rrb.TextLogView(origin="/events", name="events")


def latency_views() -> rrb.Vertical:
    """Series above, histogram below."""
    import rerun.blueprint as rrb

    return rrb.Vertical(
        rrb.TimeSeriesView(origin="/latency", name="wall time of an update [ms]"),
        rrb.BarChartView(origin="/latency_histogram", name="number of updates over wall time [10 us]"),
        name="latency",
    )
