# SPDX-License-Identifier: BSD-3-Clause
"""Covariance of the newest state: correlations at some instants and over time, and the ellipsoid of the tip."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.graphs.fixed_lag.window.state_names import state_names
from jointscope.tools.presentation.numbers import prefixed
from jointscope.tools.presentation.sensor_signals import COLOURS
from jointscope.tools.presentation.settled import settled_reach
from jointscope.tools.presentation.tip_ellipsoid import tip_half_axes
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.plot import Axes, Curve, plot
from jointscope.tools.report.sections.calibration.correlation import heat_map

Array = NDArray[np.float64]

PAIRS = 6
INSTANTS = (0.15, 0.85)  # shares of the recording


def correlation_over_time(result: ReplayResult) -> Section:
    """Two heat maps, the liveliest pairs over time, and the half axes of the ellipsoid."""
    lead = (
        "How the errors of the states hang together. A correlation near ±1 says that the sensors determine only the "
        "sum or the difference of two states."
    )
    series = result.covariances
    if len(series.times) < 2:
        return Section("covariance", "Covariance", "<p>There is nothing to show.</p>", lead)
    names, C = state_names(result.robot.layout), correlation_matrices(series.matrices)
    maps = "".join(_map(names, series.times, C, share) for share in INSTANTS)
    body = (
        f'<div class="two">{maps}</div>'
        + "<h3>Correlations over time</h3>"
        + _pairs(names, series.times, C)
        + "<h3>Where the end effector is</h3>"
        + _ellipsoid(result)
    )
    return Section("covariance", "Covariance", body, lead)


def correlation_matrices(P: Array) -> Array:
    """Correlations of covariance matrices, shape (m, d, d)."""
    sigma = np.sqrt(np.maximum(np.einsum("kii->ki", P), 1e-300))
    return np.asarray(np.clip(P / (sigma[:, :, None] * sigma[:, None, :]), -1.0, 1.0))


def _map(names: tuple[str, ...], times: Array, C: Array, share: float) -> str:
    k = int(share * (len(times) - 1))
    return f"<div><h3>{escape(f'at {times[k]:.2f} s')}</h3>{figure([heat_map(names, C[k])])}</div>"


def _pairs(names: tuple[str, ...], times: Array, C: Array) -> str:
    """The pairs that are correlated most, or whose correlation changes most."""
    rows, columns = np.tril_indices(len(names), -1)
    values = C[:, rows, columns]
    interest = np.abs(values).mean(axis=0) + 2.0 * values.std(axis=0)
    chosen = np.argsort(-interest)[:PAIRS]
    labels = [f"{names[rows[k]]} · {names[columns[k]]}" for k in chosen]
    curves = [
        Curve(label, times, values[:, k], COLOURS[i]) for i, (label, k) in enumerate(zip(labels, chosen, strict=True))
    ]
    axes = Axes("correlation", height=230, y_range=(-1.05, 1.05))
    return figure([plot(axes, curves)], [Key(label, COLOURS[i]) for i, label in enumerate(labels)], group="replay")


def _ellipsoid(result: ReplayResult) -> str:
    series = result.covariances
    half = tip_half_axes(result.robot, result.states, series)
    factor, unit = prefixed(float(np.median(half[:, -1])), "m")
    words = ("shortest", "middle", "longest")
    curves = [
        Curve(word, series.times, factor * half[:, i], COLOURS[i], points=800) for i, word in enumerate(words) if i
    ]
    top = factor * settled_reach(series.times, half[:, -1])
    axes = Axes(f"half axes of the 2 sigma ellipsoid [{unit}]", height=200, y_range=(0.0, top or 1.0))
    caption = (
        "From the full covariance of all link coordinates. The tip moves on a sphere about the joints where their axes "
        "meet, then the third axis vanishes."
    )
    return figure([plot(axes, curves)], [Key(w, COLOURS[i]) for i, w in enumerate(words) if i], caption, "replay")
