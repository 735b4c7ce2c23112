# SPDX-License-Identifier: BSD-3-Clause
"""What one recording offers to look at: measured and predicted signals, and a stretch worth a closer look."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.robots.parts.sensors import Gyro
from jointscope.robots.units import joined

Array = NDArray[np.float64]

RATE_SPAN = 0.02  # [s] of a central difference: encoder noise becomes 5e-3 rad/s
ZOOM = 2.0  # [s]
COLOURS = ("k0", "k1", "k2", "k3", "k4", "k5")


@dataclass(frozen=True)
class SignalRow:
    """One row of Figs. 5 to 8: measured and predicted, several components.

    Attributes:
        title: what it is.
        unit: SI unit.
        parts: short name of each component ("joint1", "x").
        times, measured: shape (m,) [s] and (m, c) [unit].
        predicted_times, predicted: shape (k,) [s] and (k, c) [unit].
    """

    title: str
    unit: str
    parts: tuple[str, ...]
    times: Array
    measured: Array
    predicted_times: Array
    predicted: Array


def signal_rows(result: CalibrationResult, bag: BagFit) -> list[SignalRow]:
    """Motor position, motor velocity, then the gyros from the tip to the base, as in the paper's figures."""
    robot, rows = result.robot, []
    encoder = bag.residuals.get(robot.motor_encoder.name)
    if encoder is not None:
        t = encoder.times
        rows.append(
            SignalRow("motor position", robot.unit("rad"), robot.joints, t, encoder.measured, t, encoder.predicted)
        )
        rate_times, rate = central_difference(t, encoder.measured)
        v_motor = bag.states[:, robot.layout.motor_v]
        rows.append(
            SignalRow("motor velocity", robot.unit("rad/s"), robot.joints, rate_times, rate, bag.ticks, v_motor)
        )
    for gyro in reversed(robot.gyros):
        series = bag.residuals.get(gyro.name)
        if series is not None:
            parts = tuple(channel.rsplit(".", 1)[-1] for channel in series.channels)
            t = series.times
            rows.append(
                SignalRow(_gyro_title(gyro), joined(series.units), parts, t, series.measured, t, series.predicted)
            )
    return rows


def central_difference(times: Array, values: Array) -> tuple[Array, Array]:
    """Rate of change over RATE_SPAN seconds around each sample; times, shape (k,), and rates, shape (k, c)."""
    period = float(np.median(np.diff(times))) if len(times) > 1 else RATE_SPAN
    reach = max(round(0.5 * RATE_SPAN / period), 1)
    if len(times) <= 2 * reach:
        return times[:0], values[:0]
    dt = times[2 * reach :] - times[: -2 * reach]
    return times[reach:-reach], (values[2 * reach :] - values[: -2 * reach]) / dt[:, None]


def liveliest(times: Array, velocity: Array) -> tuple[float, float]:
    """The stretch of ZOOM seconds with the strongest accelerations, all joints counted alike; limits [s]."""
    begin, end = float(times[0]), float(times[-1])
    if end - begin <= ZOOM:
        return begin, end
    grid = np.linspace(begin, end, max(int((end - begin) / 0.01), 2))
    v = np.column_stack([np.interp(grid, times, column) for column in velocity.T])
    a = np.abs(np.diff(v, axis=0)) / np.maximum(np.std(v, axis=0), 1e-9)
    width = max(int(ZOOM / (grid[1] - grid[0])), 1)
    # the joint that moves least in the stretch decides: a closer look should show all of them
    sums = np.cumsum(np.vstack([np.zeros(a.shape[1]), a]), axis=0)
    busy = (sums[width:] - sums[:-width]).min(axis=1)
    start = float(grid[int(np.argmax(busy))])
    return start, start + ZOOM


def bag_name(bag: BagFit, index: int) -> str:
    """Short name of a recording for headings."""
    return Path(bag.recording.path).name or f"recording {index + 1}"


def points_per_curve(bags: Sequence[BagFit]) -> int:
    """Fewer points per curve where many recordings share one page."""
    return max(1500 // max(len(bags), 1), 500)


def _gyro_title(gyro: Gyro) -> str:
    return f"{gyro.name} on {gyro.body}, sensor axes"
