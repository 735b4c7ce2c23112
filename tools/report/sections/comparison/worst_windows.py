# SPDX-License-Identifier: BSD-3-Clause
"""The stretches of time in which predictions fail most, seen closely."""

from __future__ import annotations

from html import escape

from jointscope.graphs.comparison.comparison_result import ComparisonResult, WorstWindow
from jointscope.tools.presentation.numbers import percent
from jointscope.tools.report.page.page import Key, Section, figure, table
from jointscope.tools.report.page.plot import Axes, Curve, Mark, plot
from jointscope.tools.report.sections.comparison.model_colours import model_colour, model_keys
from jointscope.tools.report.sections.comparison.predictions import channel_marks, joined

SHOWN = 4
AROUND = 0.75  # [s] before and after


def worst_windows(result: ComparisonResult) -> Section:
    """A table of all models' worst windows and a closer look at the first model's."""
    rows = [
        [
            f'<span class="{model_colour(i)}"><i class="swatch coloured"></i></span>{escape(model.label)}',
            f"<code>{escape(w.channel)}</code>",
            f"{w.t0:.2f} to {w.t1:.2f}",
            percent(w.share),
        ]
        for i, model in enumerate(result.models)
        for w in model.worst[:SHOWN]
    ]
    head = ["model", "channel", "time [s]", "share of the squared error"]
    body = table(head, rows, [2, 3]) if rows else "<p>No window stands out.</p>"
    if rows:
        body += "".join(_closer(result, w) for w in result.models[0].worst[:SHOWN])
    lead = "Where and when the 0.1 s ahead predictions are worst. What the robot did just then is the first clue."
    return Section("worst", "Worst windows", body, lead)


def _closer(result: ComparisonResult, window: WorstWindow) -> str:
    plots = window_plots(result, window)
    return figure(plots, window_keys(result)) if plots else ""


def window_keys(result: ComparisonResult) -> list[Key]:
    """Legend of `window_plots`."""
    return [Key("measured", "soft", "wide"), *model_keys(result)]


def window_plots(result: ComparisonResult, window: WorstWindow, width: int = Axes.width) -> list[str]:
    """Measurement and predictions around a window, and below it their errors; nothing of an unknown channel.

    Args:
        result: models on one recording.
        window: stretch of time of one channel.
        width: of each plot [px].
    """
    for name, sensor in result.models[0].sensors.items():
        if window.channel in sensor.channels:
            title, marks = channel_marks(result, name, sensor.channels.index(window.channel), "ahead")
            limits = (
                max(window.t0 - AROUND, float(sensor.times[0])),
                min(window.t1 + AROUND, float(sensor.times[-1])),
            )
            shade = (window.t0, window.t1)
            errors = _errors(result, name, sensor.channels.index(window.channel))
            below = "measured − predicted [sensor sigma]"
            return [
                plot(Axes(title, "", width, 150, x_range=limits, shade=shade), marks),
                plot(Axes(below, width=width, height=150, x_range=limits, shade=shade), errors),
            ]
    return []


def _errors(result: ComparisonResult, sensor: str, i: int) -> list[Mark]:
    curves: list[Mark] = []
    for k, model in enumerate(result.models):
        if sensor in model.sensors:
            p = model.sensors[sensor]
            times, error = joined(p.times, (p.measured[:, i] - p.ahead[:, i]) / p.sigmas[i])
            curves.append(Curve(model.label, times, error, model_colour(k), "solid"))
    return curves
