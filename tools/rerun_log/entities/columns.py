# SPDX-License-Identifier: BSD-3-Clause
"""Many samples at once: several series of one entity share their times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.rerun_log.entities.viewer_text import viewer_text

if TYPE_CHECKING:
    import rerun as rr

Array = NDArray[np.float64]
Colour = tuple[int, int, int]

TIMELINE = "sim_time"
JOINT_COLOURS: tuple[Colour, ...] = (
    (240, 110, 60),
    (40, 190, 145),
    (75, 165, 235),
    (220, 130, 190),
    (220, 180, 60),
    (150, 155, 245),
)
GREY: Colour = (150, 158, 166)
WHITE: Colour = (235, 238, 240)


def time_column(times: Array) -> rr.TimeColumn:
    """Times since the start of the recording, shape (m,) [s], as a column."""
    import rerun as rr

    return rr.TimeColumn(TIMELINE, duration=np.rint(np.asarray(times) * 1e9).astype("timedelta64[ns]"))


def send_lines(
    stream: rr.RecordingStream,
    path: str,
    times: Array,
    values: Array,
    names: Sequence[str],
    colours: Sequence[Colour],
    width: float = 1.0,
) -> None:
    """Several lines over time.

    Args:
        stream: where to.
        path: entity.
        times: shape (m,) [s].
        values: shape (m, c); NaN interrupts a line.
        names: legend, c of them.
        colours: c of them.
        width: of the lines [px].
    """
    import rerun as rr

    # the viewer would draw averages of many samples, which hide the peaks
    policy = rr.components.AggregationPolicy.MinMax
    style = rr.SeriesLines(
        names=[viewer_text(name) for name in names],
        colors=list(colours),
        aggregation_policy=policy,
        widths=[width] * len(names),
    )
    stream.log(path, style, static=True)
    if len(times):
        matrix = np.ascontiguousarray(values, dtype=float)
        stream.send_columns(path, [time_column(times)], rr.Scalars.columns(scalars=matrix))


def send_band(
    stream: rr.RecordingStream,
    path: str,
    times: Array,
    middle: Array,
    half_width: Array,
    colours: Sequence[Colour],
) -> None:
    """Two thin dim lines per series at middle +- half_width, shapes (m, c); fewer samples, as bands are smooth."""
    keep = thinned(len(times))
    dim = [tuple(c // 2 + 40 for c in colour) for colour in colours]
    edges = ((middle - half_width)[keep], (middle + half_width)[keep])
    both = np.hstack(edges)
    labels = [f"{sign}3 sigma" for sign in ("−", "+") for _ in colours]
    send_lines(stream, path, times[keep], both, labels, [*dim, *dim], 0.7)  # type: ignore[list-item]


def thinned(count: int, most: int = 8000) -> NDArray[np.intp]:
    """At most `most` evenly spread indices of `count`."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(most, count)).astype(np.intp))
