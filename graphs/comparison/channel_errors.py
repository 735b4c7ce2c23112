# SPDX-License-Identifier: BSD-3-Clause
"""Prediction errors of one channel, with what the model allows and what it predicts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.comparison.comparison_result import ModelComparison, SensorPrediction
from jointscope.graphs.noise.whiteness_test import evenly

Array = NDArray[np.float64]

SOON = 0.01  # [s] the shortest horizon of a comparison
AHEAD = 0.1  # [s] the horizon of `ModelComparison.error`
FEWEST = 10  # predictions below which a channel says nothing


@dataclass(frozen=True)
class ChannelErrors:
    """Errors (measured - predicted) of one channel, 0.1 s ahead.

    Attributes:
        channel: its name.
        sensor: name of the sensor.
        unit: SI unit.
        sigma: standard deviation of the sensor's noise [unit].
        floor: root mean square that noise and state uncertainty would leave [unit].
        times: where predictions end, shape (m,) [s].
        error: shape (m,) [unit].
        predicted: shape (m,) [unit].
        separate: errors on an even grid on which predictions do not overlap, NaN where there is none, shape (k,).
        separate_times: of the grid, shape (k,) [s].
    """

    channel: str
    sensor: str
    unit: str
    sigma: float
    floor: float
    times: Array
    error: Array
    predicted: Array
    separate: Array
    separate_times: Array

    @property
    def rms(self) -> float:
        """Root mean square error [unit]."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def excess(self) -> float:
        """Error over what is allowed, 1 if nothing is missing."""
        return self.rms / self.floor

    @property
    def predicted_rms(self) -> float:
        """Root mean square of what is predicted, without its mean [unit]."""
        return float(np.std(self.predicted))


def channel_errors(comparison: ModelComparison) -> list[ChannelErrors]:
    """Errors of all channels of a comparison that have enough predictions."""
    found = []
    for name, sensor in comparison.sensors.items():
        for j, channel in enumerate(sensor.channels):
            known = np.isfinite(sensor.ahead[:, j])
            if np.sum(known) < FEWEST:
                continue
            predicted = sensor.ahead[known, j]
            floor = comparison.floors.get(channel, comparison.floor) * sensor.sigmas[j]
            times, error = sensor.times[known], sensor.measured[known, j] - predicted
            separate = _separate(sensor, j, times, error)
            found.append(
                ChannelErrors(
                    channel, name, sensor.units[j], sensor.sigmas[j], floor, times, error, predicted, *separate
                )
            )
    return found


def _separate(sensor: SensorPrediction, j: int, times: Array, error: Array) -> tuple[Array, Array]:
    """Errors of predictions that do not overlap: 0.01 s ahead if there are such, else 0.1 s ahead; and their times."""
    spacing = AHEAD
    if sensor.soon is not None:
        known = np.isfinite(sensor.soon[:, j])
        if np.sum(known) >= FEWEST:
            spacing = SOON
            times, error = sensor.times[known], sensor.measured[known, j] - sensor.soon[known, j]
    grid = evenly(times, error, spacing)
    return grid, times[0] + spacing * np.arange(len(grid))
