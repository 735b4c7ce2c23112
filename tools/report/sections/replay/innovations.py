# SPDX-License-Identifier: BSD-3-Clause
"""Innovations of every channel: over time with the +-3 sigma that the filter expects, distribution, memory."""

from __future__ import annotations

from html import escape

import numpy as np

from jointscope.graphs.calibration.stages.residual_series import ResidualSeries
from jointscope.graphs.fixed_lag.replay.replay_result import InnovationSeries, ReplayResult
from jointscope.tools.presentation.numbers import prefixed, significant
from jointscope.tools.report.page.page import Section, figure, table
from jointscope.tools.report.sections.calibration.residuals import histogram, memory, over_time
from jointscope.tools.verdicts.replay_judgement import nis_level

POINTS = 1000


def innovations(result: ReplayResult) -> Section:
    """A table per channel, then one row of three plots per channel."""
    lead = (
        "Measured minus what the estimator predicted just before the sample came. A filter that is right keeps them "
        "inside their band, without memory."
    )
    rows = [_row(series, j) for series in result.innovations.values() for j in range(len(series.channels))]
    head = ["channel", "rms residual", "expected", "unit", "NIS", "left out"]
    plots = []
    for series in result.innovations.values():
        shown = _as_residuals(series)
        plots += [
            f'<div class="row">{over_time(shown, j, POINTS, reach(series, j))}'
            f"{histogram(shown, j)}{memory(shown, j)}</div>"
            for j in range(len(series.channels))
        ]
    caption = (
        "Left: residual with the ±3 sigma that is expected of it: sensor noise and uncertainty of the prediction. "
        "Middle: distribution in sigmas, with the normal one as a line. Right: autocorrelation with the band of white "
        "noise. Samples that were left out as outliers are not drawn."
    )
    body = table(head, rows, [1, 2, 4, 5]) + figure(plots, caption=caption, group="residuals")
    return Section("residuals", "Residuals", body, lead)


def reach(series: InnovationSeries, j: int) -> float:
    """How far an axis must reach to show the usual band and nearly all residuals; the first sigmas are far larger."""
    band = 3.0 * _median(series.sigma[series.used, j])
    residuals = np.abs(series.residual[series.used, j])
    residuals = residuals[np.isfinite(residuals)]
    largest = float(np.quantile(residuals, 0.999)) if len(residuals) else 0.0
    return 1.4 * max(band if np.isfinite(band) else 0.0, largest) or 1.0


def _row(series: InnovationSeries, j: int) -> list[str]:
    used = series.used
    expected = _median(series.sigma[used, j])
    factor, unit = prefixed(expected, series.units[j])
    nis = series.channel_nis.get(series.channels[j], float("nan"))
    tone = f'<span class="{nis_level(nis)}" style="color:var(--tone)">{significant(nis)}</span>'
    rms = significant(factor * _rms(series.residual[used, j]))
    out = f"{int(np.count_nonzero(~used))}" if j == 0 else ""
    return [f"<code>{escape(series.channels[j])}</code>", rms, significant(factor * expected), unit, tone, out]


def _as_residuals(series: InnovationSeries) -> ResidualSeries:
    kept = np.where(series.used[:, None], series.residual, np.nan)
    sigma = np.where(np.isfinite(series.sigma), series.sigma, np.nanmedian(series.sigma, axis=0, keepdims=True))
    return ResidualSeries(series.channels, series.units, series.times, kept, np.zeros_like(kept), sigma)


def _rms(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _median(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(np.median(values)) if len(values) else float("nan")
