# SPDX-License-Identifier: BSD-3-Clause
"""Normalised innovations squared in windows of time, with the bounds of chi-square.

In a window with N innovations of c channels each, the sum of squares has N c degrees of freedom if the model is right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from jointscope.graphs.fixed_lag.replay.replay_result import InnovationSeries

Array = NDArray[np.float64]

WINDOW = 0.25  # [s]
FEWEST = 25  # innovations in a window
INSIDE = 0.999  # probability of the bounds, for each window
MOST_LAGS = 200  # samples over which neighbours are looked at


@dataclass(frozen=True)
class NisWindows:
    """NIS per degree of freedom over time.

    Attributes:
        times: middle of each window, shape (w,) [s].
        sensor: of all channels together, shape (w,).
        channels: mean square of residual over sigma, shape (w, c).
        low, high: bounds for the sensor, shape (w,).
        outside: share of the windows with samples outside of the bounds.
    """

    times: Array
    sensor: Array
    channels: Array
    low: Array
    high: Array

    @property
    def outside(self) -> float:
        """Share of the windows outside of the bounds; INSIDE leaves one in a thousand."""
        known = np.isfinite(self.sensor)
        return (
            float(np.mean((self.sensor < self.low)[known] | (self.sensor > self.high)[known])) if known.any() else 0.0
        )

    @staticmethod
    def of(series: InnovationSeries, window: float = WINDOW) -> NisWindows:
        """Windows of at least `window` seconds and FEWEST innovations; gated ones are left out."""
        t, used = series.times, series.used
        if not len(t):
            nothing = np.zeros(0)
            return NisWindows(nothing, nothing, np.zeros((0, len(series.channels))), nothing, nothing)
        span = max(float(t[-1] - t[0]), 1e-9)
        window = max(window, FEWEST * span / len(t))
        index = np.minimum(((t - t[0]) / window).astype(int), max(int(span / window), 1) - 1)
        w = int(index.max()) + 1

        def summed(values: Array) -> Array:
            return np.asarray(np.bincount(index[used], weights=values[used], minlength=w), dtype=float)

        squares = np.nan_to_num((series.residual / series.sigma) ** 2)
        nis, dof, count = summed(series.nis), summed(series.dof), summed(np.ones(len(t)))
        with np.errstate(invalid="ignore", divide="ignore"):
            sensor = nis / dof
            channels = np.column_stack([summed(column) / count for column in squares.T])
            low, high = (chdtri(dof, 0.5 * (1.0 - s * INSIDE)) / dof for s in (-1.0, 1.0))
        return NisWindows(t[0] + (np.arange(w) + 0.5) * window, sensor, channels, low, high)


def nis_bounds(series: InnovationSeries) -> tuple[float, float]:
    """Between which the mean NIS of a consistent sensor lies but for one recording in a thousand.

    A chi-square with as many degrees of freedom as there are independent ones: neighbours that are alike count less.
    """
    dof = series.dof_sum / max(_memory(series.nis[series.used] / np.maximum(series.dof[series.used], 1.0)), 1.0)
    if not dof > 0.0:
        return 0.0, float("inf")
    return float(chdtri(dof, 0.5 * (1.0 + INSIDE)) / dof), float(chdtri(dof, 0.5 * (1.0 - INSIDE)) / dof)


def _memory(values: Array) -> float:
    """How many neighbours say the same: 1 + 2 times the sum of the autocorrelation up to where it ends."""
    values = values[np.isfinite(values)]
    values = values - np.mean(values) if len(values) else values
    power, found = float(values @ values), 1.0
    for lag in range(1, min(MOST_LAGS, len(values) // 4)):
        correlation = float(values[lag:] @ values[:-lag]) / max(power, 1e-300)
        if correlation < 2.0 / np.sqrt(len(values)):
            break
        found += 2.0 * correlation
    return found
