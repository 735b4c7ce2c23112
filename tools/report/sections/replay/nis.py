# SPDX-License-Identifier: BSD-3-Clause
"""NIS of every sensor over time with the bounds of chi-square: when and where the sigmas do not hold."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.fixed_lag.replay.nis_windows import NisWindows
from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.tools.presentation.numbers import percent
from jointscope.tools.presentation.sensor_signals import COLOURS
from jointscope.tools.report.page.page import Key, Section, figure
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Band, Curve, Mark

SMALLEST = 0.1


def nis(result: ReplayResult) -> Section:
    """One panel per sensor, logarithmic."""
    lead = (
        "Squares of the residuals over what is expected of them, in windows. Inside the grey band model, noise and "
        "covariance are consistent; far above it something is missing from the model or a sensor is not what it says; "
        "below it the stated noise is too large."
    )
    limits = (float(result.states.times[0]), float(result.states.times[-1]))
    panels = []
    for name, series in result.innovations.items():
        windows = NisWindows.of(series)
        t = windows.times
        marks: list[Mark] = [Band("99.9 %", t, windows.low, windows.high, "soft")]
        marks += [
            Curve(f"channel {j + 1}", t, np.maximum(windows.channels[:, j], SMALLEST), COLOURS[j % 6], "hair")
            for j in range(len(series.channels))
        ]
        marks.append(Curve("sensor", t, np.maximum(windows.sensor, SMALLEST), "ink"))
        title = f"{name}: NIS per degree of freedom, outside of the bounds in {percent(windows.outside)} of the windows"
        panels.append((Axes(title, height=150, x_range=limits, y_range=_range(windows), log_y=True), marks))
    keys = [Key("sensor", "ink"), *(Key(f"channel {j + 1}", COLOURS[j]) for j in range(3))]
    body = figure(below_each_other(panels), [*keys, Key("99.9 %", "soft", "band")], group="replay")
    return Section("nis", "Consistency over time", body, lead)


def _range(windows: NisWindows) -> tuple[float, float]:
    """From a half to two at least, so that one is in the middle where all is well."""
    shown = np.concatenate([windows.sensor, windows.channels.ravel()])
    shown = np.maximum(shown[np.isfinite(shown)], SMALLEST)
    low, high = (float(shown.min()), float(shown.max())) if len(shown) else (1.0, 1.0)
    return min(0.45, 0.9 * low), max(2.2, 1.1 * high)
