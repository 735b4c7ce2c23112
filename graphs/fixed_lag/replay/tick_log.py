# SPDX-License-Identifier: BSD-3-Clause
"""Writes down what a fixed-lag estimator said at each tick, in bounded memory and with little work per tick."""

from __future__ import annotations

from array import array

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.replay.replay_result import CovarianceSeries, InnovationSeries, Latency, StateSeries
from jointscope.graphs.fixed_lag.tick import Tick
from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

MATRICES = 4096
MATRIX_STEP = 0.02  # [s] between two covariance matrices, before thinning
FIRST = 4096  # rows
MOST = 1 << 17  # rows: 131 s at 1 kHz are kept whole


class TickLog:
    """Ticks as series."""

    def __init__(self, robot: Robot):
        self.ticks = 0
        self._robot = robot
        self._now = StateLog(robot)
        self._lagged = StateLog(robot)
        self._innovations: dict[str, InnovationLog] = {}
        d = robot.layout.size
        self._matrices = ThinnedRows(1 + d * d, MATRICES)
        self._next_matrix = -np.inf
        self._seconds = array("f")
        self._latency = ThinnedRows(2)

    @property
    def stride(self) -> int:
        """Every stride-th tick is in the series."""
        return self._now.stride

    def add(self, tick: Tick, lagged: EstimatedState | None, seconds: float) -> None:
        """Writes down a tick and the state at the lag; the update took so long [s]."""
        state = tick.state
        self.ticks += 1
        self._now.add(state)
        if lagged is not None:
            self._lagged.add(lagged)
        for innovation in tick.innovations:
            log = self._innovations.get(innovation.sensor)
            if log is None:
                channels = self._robot.sensors[innovation.sensor].channels
                log = self._innovations[innovation.sensor] = InnovationLog(channels)
            log.add(innovation)
        self._seconds.append(seconds)
        if (row := self._latency.next()) is not None:
            row[:] = state.time, seconds
        if state.time >= self._next_matrix:
            self._next_matrix = max(self._next_matrix + MATRIX_STEP, state.time + 0.5 * MATRIX_STEP)
            if (row := self._matrices.next()) is not None:
                row[0], row[1:] = state.time, state.covariance.ravel()

    def states(self) -> StateSeries:
        """The newest states."""
        return self._now.series()

    def lagged(self) -> StateSeries:
        """The states at the lag."""
        return self._lagged.series()

    def innovations(self) -> dict[str, InnovationSeries]:
        """By sensor, in the order of the robot."""
        sensors = self._robot.sensors
        return {n: self._innovations[n].series(sensors[n].units) for n in sensors if n in self._innovations}

    def covariances(self) -> CovarianceSeries:
        """Covariance matrices of the newest states."""
        rows, d = self._matrices.rows, self._robot.layout.size
        return CovarianceSeries(rows[:, 0], rows[:, 1:].reshape(-1, d, d))

    def latency(self) -> Latency:
        """Wall time of the updates."""
        seconds = np.frombuffer(self._seconds, dtype=np.float32).astype(float)
        if not len(seconds):
            seconds = np.full(1, np.nan)
        p50, p99 = np.quantile(seconds, [0.5, 0.99])
        rows = self._latency.rows
        return Latency(float(p50), float(p99), float(seconds.max()), float(seconds.mean()), rows[:, 0], rows[:, 1])


class StateLog:
    """Estimated states as rows: time, mean, sigma, sigma of the deflections, biases and parameters with sigmas."""

    def __init__(self, robot: Robot):
        self._layout = robot.layout
        self._rows: ThinnedRows | None = None
        self._gyros: tuple[str, ...] = ()
        self._parameters: tuple[str, ...] = ()

    @property
    def stride(self) -> int:
        """Every stride-th state is kept."""
        return 1 if self._rows is None else self._rows.stride

    def add(self, state: EstimatedState) -> None:
        """Writes a state down; the first one says which biases and parameters there are."""
        if self._rows is None:
            self._gyros, self._parameters = tuple(state.biases), tuple(state.parameters)
            layout = self._layout
            width = 1 + 2 * layout.size + len(layout.joints) + 6 * len(self._gyros) + 2 * len(self._parameters)
            self._rows = ThinnedRows(width)
        row = self._rows.next()
        if row is None:
            return
        d, layout, P = self._layout.size, self._layout, state.covariance
        variance = P.diagonal()
        link, motor = layout.joint_q, layout.motor_q
        row[0] = state.time
        row[1 : 1 + d] = state.mean
        row[1 + d : 1 + 2 * d] = np.sqrt(np.maximum(variance, 0.0))
        at = 1 + 2 * d
        spread = variance[link] + variance[motor] - 2.0 * P[link, motor]
        row[at : at + len(link)] = np.sqrt(np.maximum(spread, 0.0))
        at += len(link)
        for name in self._gyros:
            row[at : at + 3], row[at + 3 : at + 6] = state.biases[name], state.bias_sigmas[name]
            at += 6
        for name in self._parameters:
            row[at : at + 2] = state.parameters[name]
            at += 2

    def series(self) -> StateSeries:
        """The rows taken apart."""
        d, n = self._layout.size, len(self._layout.joints)
        rows = np.empty((0, 1 + 2 * d + n)) if self._rows is None else self._rows.rows
        at = 1 + 2 * d + n
        biases, sigmas, parameters = {}, {}, {}
        for name in self._gyros:
            biases[name], sigmas[name] = rows[:, at : at + 3], rows[:, at + 3 : at + 6]
            at += 6
        for name in self._parameters:
            parameters[name] = rows[:, at : at + 2]
            at += 2
        mean, sigma, deflection = rows[:, 1 : 1 + d], rows[:, 1 + d : 1 + 2 * d], rows[:, 1 + 2 * d : 1 + 2 * d + n]
        return StateSeries(rows[:, 0], mean, sigma, deflection, biases, sigmas, parameters)


class InnovationLog:
    """Innovations of one sensor as rows: time, nis, dof, used, residual, sigma; and sums over all of them."""

    def __init__(self, channels: tuple[str, ...]):
        self._channels = channels
        self._rows = ThinnedRows(4 + 2 * len(channels))
        self._squares, self._used = np.zeros(len(channels)), np.zeros(len(channels))
        self._nis = self._dof = 0.0
        self._count = 0

    def add(self, innovation: Innovation) -> None:
        """Writes an innovation down; channels that were not looked at are NaN."""
        looked_at: slice | list[int] = slice(None)
        if len(innovation.channels) != len(self._channels):
            looked_at = [self._channels.index(channel) for channel in innovation.channels]
        self._count += 1
        if innovation.used:
            self._squares[looked_at] += (innovation.residual / innovation.sigma) ** 2
            self._used[looked_at] += 1
            self._nis += innovation.nis
            self._dof += innovation.dof
        row = self._rows.next()
        if row is not None:
            c = len(self._channels)
            row[:4] = innovation.time, innovation.nis, innovation.dof, innovation.used
            row[4:] = np.nan
            row[4 : 4 + c][looked_at], row[4 + c :][looked_at] = innovation.residual, innovation.sigma

    def series(self, units: tuple[str, ...]) -> InnovationSeries:
        """The rows taken apart."""
        rows, c = self._rows.rows, len(self._channels)
        rows = rows[np.argsort(rows[:, 0], kind="stable")]  # late samples came after newer ones
        with np.errstate(invalid="ignore", divide="ignore"):
            by_channel = self._squares / self._used
        return InnovationSeries(
            channels=self._channels,
            units=units,
            times=rows[:, 0],
            residual=rows[:, 4 : 4 + c],
            sigma=rows[:, 4 + c :],
            nis=rows[:, 1],
            dof=rows[:, 2],
            used=rows[:, 3] > 0.5,
            nis_mean=self._nis / self._dof if self._dof else float("nan"),
            dof_sum=self._dof,
            channel_nis=dict(zip(self._channels, by_channel.tolist(), strict=True)),
            count=self._count,
        )


class ThinnedRows:
    """Rows 0, k, 2 k, ... of all that were offered; k is a power of two.

    Attributes:
        stride: k.
    """

    def __init__(self, width: int, most: int = MOST):
        """Empty.

        Args:
            width: numbers in a row.
            most: rows kept, even.
        """
        self._most = most
        self.stride = 1
        self._offered = 0
        self._kept = 0
        self._rows = np.empty((min(FIRST, most), width))

    def next(self) -> Array | None:
        """Where to write the next row, shape (width,); None where it is not wanted."""
        wanted = self._offered % self.stride == 0
        self._offered += 1
        if not wanted:
            return None
        if self._kept == self._most:
            # the row at hand has number stride * most, a multiple of the doubled stride
            self._rows[: self._most // 2] = self._rows[::2].copy()
            self._kept, self.stride = self._most // 2, 2 * self.stride
        elif self._kept == len(self._rows):
            grown = np.empty((min(2 * len(self._rows), self._most), self._rows.shape[1]))
            grown[: self._kept] = self._rows
            self._rows = grown
        self._kept += 1
        return self._rows[self._kept - 1]

    @property
    def rows(self) -> Array:
        """What was kept, shape (m, width)."""
        return self._rows[: self._kept]
