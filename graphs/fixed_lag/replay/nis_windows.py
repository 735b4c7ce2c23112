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
