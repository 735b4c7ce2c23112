# SPDX-License-Identifier: BSD-3-Clause
"""How the states of the newest tick hang together, as a heat map that changes over time."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.replay.replay_result import CovarianceSeries
from jointscope.graphs.fixed_lag.window.state_names import state_names
from jointscope.robots.model.robot import Robot
from jointscope.tools.rerun_log.entities.columns import thinned, time_column
from jointscope.tools.rerun_log.entities.covariance_picture import heat_map_pixels

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

PICTURES = 240  # in a file
PICTURE_STEP = 0.2  # [s]


def send_correlations(stream: rr.RecordingStream, robot: Robot, series: CovarianceSeries, most: int = PICTURES) -> None:
    """Entity covariance/correlation: a picture every PICTURE_STEP seconds, fewer if there were too many."""
    import rerun as rr

    if not len(series.times):
        return
    span = float(series.times[-1] - series.times[0])
    keep = thinned(len(series.times), min(most, int(span / PICTURE_STEP) + 1))
    names = state_names(robot.layout)
    blobs = [_png(heat_map_pixels(names, correlations(series.matrices[k]))) for k in keep]
    columns = rr.EncodedImage.columns(blob=blobs, media_type=["image/png"] * len(blobs))
    stream.send_columns("covariance/correlation", [time_column(series.times[keep])], columns)


def correlation_view() -> rrb.Spatial2DView:
    """The picture."""
    import rerun.blueprint as rrb

    return rrb.Spatial2DView(origin="/covariance/correlation", name="correlation of the newest state")


def correlations(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Correlation matrix of a covariance matrix; states without variance correlate with nothing."""
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(sigma > 0.0, 1.0 / np.where(sigma > 0.0, sigma, 1.0), 0.0)
    return np.asarray(np.clip(covariance * np.outer(scale, scale), -1.0, 1.0))


def _png(pixels: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(pixels).save(out, format="PNG", compress_level=1)
    return out.getvalue()
