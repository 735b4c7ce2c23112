# SPDX-License-Identifier: BSD-3-Clause
"""Residuals of every channel: over time with their +-3 sigma band, as a histogram, and their autocorrelation."""

from __future__ import annotations

from html import escape

import numpy as np

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.graphs.calibration.stages.residual_series import ResidualSeries
from jointscope.tools.presentation.numbers import percent, prefixed, significant
from jointscope.tools.presentation.sensor_signals import COLOURS, points_per_curve
from jointscope.tools.report.page.page import Section, figure, table
from jointscope.tools.report.page.plot import Axes, Band, Bars, Curve, Mark, plot
from jointscope.tools.report.sections.calibration.per_bag import per_bag
from jointscope.tools.verdicts.whiteness import autocorrelation

EDGES = np.linspace(-5.0, 5.0, 41)  # [sigma]
GAUSS = np.linspace(-5.0, 5.0, 121)


def residuals(result: CalibrationResult) -> Section:
    """A table per channel, then one row of three plots per channel."""
    rows = []
    for name, fit in result.channels.items():
        factor, unit = prefixed(fit.sigma, fit.unit)
        tone = "good" if 0.8 <= fit.chi2 <= 1.25 else "warn" if 0.5 <= fit.chi2 <= 2.0 else "bad"
        chi2 = f'<span class="{tone}" style="color:var(--tone)">{significant(fit.chi2)}</span>'
        rows.append(
            [
                f"<code>{escape(name)}</code>",
                significant(factor * fit.rmse),
                significant(factor * fit.sigma),
                unit,
                chi2,
            ]
        )
    head = ["channel", "rms residual", "sensor sigma", "unit", "χ² per sample"]
    points = points_per_curve(result.bags)

    def draw(bag: BagFit, group: str) -> str:
        rows = [
            f'<div class="row">{over_time(series, i, points)}{histogram(series, i)}{memory(series, i)}</div>'
            for series in bag.residuals.values()
            for i in range(len(series.channels))
        ]
        caption = (
            "Left: measured − predicted with the ±3 sigma that is expected. Middle: distribution in sigmas, with the "
            "normal one as a line; outer bars: all beyond. Right: autocorrelation; white noise stays in its band."
        )
        return figure(rows, caption=caption, group=f"{group} residuals")

    lead = "What the model leaves over. Good residuals fill their band, look like the bell curve, and have no memory."
    body = table(head, rows, [1, 2, 4]) + per_bag(result, draw)
    return Section("residuals", "Residuals", body, lead)


def over_time(series: ResidualSeries, i: int, points: int, reach: float | None = None) -> str:
    """Residuals of a channel with their band; the axis goes to +- reach [unit], by default around all of it."""
    r, sigma = series.measured[:, i] - series.predicted[:, i], series.sigma[:, i]
    factor, unit = prefixed(float(np.median(sigma)) * 3.0, series.units[i])
    whitened = r / sigma
    outside = float(np.mean(np.abs(whitened[np.isfinite(whitened)]) > 3.0)) if len(r) else 0.0
    title = f"{series.channels[i]} [{unit}], outside 3 sigma: {percent(outside)}"
    colour = COLOURS[i % 6]
    marks: list[Mark] = [
        Band("±3 sigma", series.times, -3.0 * factor * sigma, 3.0 * factor * sigma, "soft"),
        Curve(series.channels[i], series.times, factor * r, colour, "hair", min(points, 1000)),
        # dense residuals hide the band: its limits are drawn again on top
        Curve("+3 sigma", series.times, 3.0 * factor * sigma, "ink", "hair", 300),
        Curve("−3 sigma", series.times, -3.0 * factor * sigma, "ink", "hair", 300),
    ]
    limits = None if reach is None else (-factor * reach, factor * reach)
    return plot(Axes(title, width=560, height=150, y_range=limits), marks)


def histogram(series: ResidualSeries, i: int) -> str:
    """Distribution of a channel's residuals in sigmas, with the normal one."""
    whitened = (series.measured[:, i] - series.predicted[:, i]) / series.sigma[:, i]
    whitened = whitened[np.isfinite(whitened)]
    density, _ = np.histogram(np.clip(whitened, EDGES[0], EDGES[-1]), EDGES)
    heights = density / max(len(whitened), 1) / (EDGES[1] - EDGES[0])
    normal = np.exp(-0.5 * GAUSS**2) / np.sqrt(2.0 * np.pi)
    top = 1.08 * max(float(heights.max(initial=0.0)), float(normal.max()))
    axes = Axes("distribution", "residual [sigma]", 240, 150, y_range=(0.0, top), zoomable=False)
    marks: list[Mark] = [Bars("", EDGES, heights, COLOURS[i % 6]), Curve("normal", GAUSS, normal, "ink", "solid")]
    return plot(axes, marks)


def memory(series: ResidualSeries, i: int) -> str:
    """Autocorrelation of a channel's residuals in sigmas, with the band of white noise."""
    r = (series.measured[:, i] - series.predicted[:, i]) / series.sigma[:, i]
    r = r[np.isfinite(r)]
    rho = autocorrelation(r)
    lags = np.arange(1, len(rho) + 1, dtype=float)
    if not len(rho):
        lags, rho = np.array([1.0]), np.array([0.0])
    limit = np.full(len(rho), 3.0 / np.sqrt(max(len(r), 1)))
    largest = max(0.25, 1.1 * float(np.max(np.abs(rho))))
    axes = Axes("autocorrelation", "lag [samples]", 240, 150, y_range=(-largest, largest), zoomable=False)
    return plot(axes, [Band("white", lags, -limit, limit, "soft"), Curve("", lags, rho, COLOURS[i % 6], "solid")])
