# SPDX-License-Identifier: BSD-3-Clause
"""Numbers per channel and horizon with the sensor's sigma beside them."""

from __future__ import annotations

from html import escape

from jointscope.graphs.comparison.comparison_result import ComparisonResult, ModelComparison
from jointscope.graphs.comparison.open_loop import OPEN_LOOP
from jointscope.tools.presentation.numbers import prefixed, significant
from jointscope.tools.report.page.page import Section, table
from jointscope.tools.report.sections.comparison.model_colours import model_colour


def horizon_table(result: ComparisonResult) -> Section:
    """One table; within a channel the best model of each column is bold."""
    rows: list[list[str]] = []
    channels = list(result.models[0].channels) if result.models else []
    horizons = list(result.models[0].channels[channels[0]].horizons) if channels else []
    for channel in channels:
        rows += _rows(result, channel, horizons)
    head = ["channel", "model", "unit", "sensor sigma", *(_horizon_name(h) for h in horizons), "fit 0.1 s ahead"]
    numbers = list(range(3, len(head)))
    lead = "Root mean square of measured − predicted. Fit: 100 % is perfect, 0 % is no better than the mean."
    return Section("channels", "Channel by channel", table(head, rows, numbers), lead)


def _rows(result: ComparisonResult, channel: str, horizons: list[str]) -> list[list[str]]:
    models = [(i, m) for i, m in enumerate(result.models) if channel in m.channels]
    rows = []
    for k, (i, model) in enumerate(models):
        fit = model.channels[channel]
        factor, unit = prefixed(fit.noise_sigma, fit.unit)
        cells = [_rmse(models, channel, h, model, factor) for h in horizons]
        label = f'<span class="{model_colour(i)}"><i class="swatch coloured"></i></span>{escape(model.label)}'
        name = f"<code>{escape(channel)}</code>" if k == 0 else ""
        fit_text = f"{fit.fit_percent:.1f} %"
        rows.append([name, label, escape(unit), significant(factor * fit.noise_sigma), *cells, fit_text])
    return rows


def _rmse(
    models: list[tuple[int, ModelComparison]], channel: str, horizon: str, model: ModelComparison, factor: float
) -> str:
    value = model.channels[channel].horizons.get(horizon)
    if value is None:
        return "—"
    best = min(m.channels[channel].horizons.get(horizon, float("inf")) for _, m in models)
    text = significant(factor * value)
    return f'<span class="best">{text}</span>' if len(models) > 1 and value <= best else text


def _horizon_name(horizon: str) -> str:
    return "open loop" if horizon == OPEN_LOOP else f"{float(horizon):g} s"
