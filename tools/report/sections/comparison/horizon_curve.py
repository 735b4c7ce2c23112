# SPDX-License-Identifier: BSD-3-Clause
"""Error against the horizon of the prediction, both logarithmic, in sigmas of the sensor."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.comparison.comparison_result import ComparisonResult, ModelComparison
from jointscope.graphs.comparison.open_loop import OPEN_LOOP
from jointscope.tools.report.page.page import Section, figure
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Curve, Mark
from jointscope.tools.report.sections.comparison.model_colours import model_colour, model_keys


def horizon_curve(result: ComparisonResult) -> Section:
    """One panel per sensor; thin lines are channels, the thick one their root mean square."""
    lead = (
        "How fast predictions go wrong. Each starts from the state known at its beginning; the last point is the open "
        "loop over the whole recording. 1 is the sensor's own noise. Thin: channels. Thick: all channels of the sensor."
    )
    if not result.models:
        return Section("horizons", "Error against horizon", "", lead)
    end = max(result.recording.duration, 1.0)
    sensors = result.models[0].sensors
    panels = []
    for name, sensor in sensors.items():
        marks: list[Mark] = []
        for i, model in enumerate(result.models):
            marks += _curves(model, sensor.channels, end, model_colour(i))
        label, levels = f"horizon [s]; at {end:.0f} s: open loop", [(1.0, "sensor sigma")]
        axes = Axes(f"{name} error [sigma]", label, height=180, log_x=True, log_y=True, levels=levels)
        panels.append((axes, marks))
    return Section("horizons", "Error against horizon", figure(below_each_other(panels), model_keys(result)), lead)


def _curves(model: ModelComparison, channels: tuple[str, ...], end: float, colour: str) -> list[Mark]:
    found, rows = [], []
    x = np.array([])
    for channel in channels:
        fit = model.channels.get(channel)
        if fit is None:
            continue
        x = np.array([end if h == OPEN_LOOP else float(h) for h in fit.horizons])
        y = np.array(list(fit.horizons.values())) / fit.noise_sigma
        order = np.argsort(x)
        x, y = x[order], y[order]
        rows.append(y)
        found.append(Curve(f"{model.label} {channel}", x, y, colour, "hair"))
    if len(rows) and all(len(y) == len(rows[0]) for y in rows):
        together = np.sqrt(np.mean(np.square(rows), axis=0))
        found.append(Curve(f"{model.label} all", x, together, colour, "thick"))
    return list(found)
