# SPDX-License-Identifier: BSD-3-Clause
"""Residuals of a solved recording: series by sensor, defects of the dynamics, scores in blocks of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.dynamics import DynamicsFactor
from jointscope.graphs.calibration.stages.residual_series import ResidualSeries
from jointscope.graphs.noise.noise_estimation import NoiseEvidence
from jointscope.graphs.noise.robust_sigma import BlockScores
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import Solution
from jointscope.graphs.solving.normal_equations import linearize_all
from jointscope.graphs.solving.posterior import ResidualPart, StatePosterior, residual_parts
from jointscope.robots.parts.sensors import Sensor

Array = NDArray[np.float64]

WHOLE = 0.5  # of the samples of a channel that must have all others, else each counts by itself


@dataclass(frozen=True)
class SensorResiduals:
    """Residuals of some samples of a sensor.

    Attributes:
        rows: channels of the factor.
        residual: shape (s, r) [unit].
        expected: their expected standard deviation, shape (s, r) [unit].
        squares: sums of the squared residuals in sigmas, shape (r,).
        freedom: expectation of these sums, shape (r,).
    """

    rows: tuple[str, ...]
    residual: Array
    expected: Array
    squares: Array
    freedom: Array

    @staticmethod
    def of(part: ResidualPart, sensor: Sensor) -> SensorResiduals:
        """Residuals of a factor's part against the sensor's own sigmas.

        Samples of a quantized encoder that share one error count for less in the fit; each of them alone still has
        the sensor's sigma, and the fit hardly follows it.
        """
        sigmas = np.broadcast_to(part.factor.sigmas, part.residual.shape)
        own = dict(zip(sensor.channels, sensor.sigmas.tolist(), strict=True))
        sigma = np.array([own.get(row, sensor.sigmas[0]) for row in part.factor.rows])  # a gyro's forms have own rows
        residual = part.residual * sigmas
        freedom = np.where(sigmas > sigma * (1.0 + 1e-9), 1.0, 1.0 - part.leverage)
        expected = np.minimum(sigmas, sigma) * np.sqrt(np.clip(freedom, 1e-6, 1.0))
        squares = np.sum((residual / np.minimum(sigmas, sigma)) ** 2, axis=0)
        return SensorResiduals(part.factor.rows, residual, expected, squares, np.sum(freedom, axis=0))


@dataclass
class BagResiduals:
    """Sums and series of one recording's residuals.

    Attributes:
        series: residuals of every chunk, by sensor.
        process: velocity defects [rad/s] and their expected deviation of every chunk.
        scores: gradient of the shared values in blocks of time.
    """

    series: dict[str, list[SensorResiduals]]
    process: list[tuple[Array, Array]]
    scores: BlockScores


def collect(
    problem: BagProblem, solution: Solution, i: int, posterior: StatePosterior, evidence: NoiseEvidence
) -> BagResiduals:
    """One pass over all residuals of a recording.

    Args:
        problem: its factors.
        solution: states and shared values of all recordings.
        i: index of the recording.
        posterior: uncertainty of its states.
        evidence: about the process noise, which this recording adds to.
    """
    ticks = problem.timeline.ticks
    scores = BlockScores(float(ticks[0]), float(ticks[-1]), solution.shared.indices(i), solution.shared.size)
    collected = BagResiduals({name: [] for name in problem.robot.sensors}, [], scores)
    x, calibration = solution.estimate.states[i], solution.estimate.calibrations[i]
    for part in residual_parts(linearize_all(problem, x, calibration), calibration, posterior):
        evidence.add(part)
        if part.factor.states:
            scores.add(ticks[part.ticks], part.residual, part.by_shared)
        if isinstance(part.factor, DynamicsFactor):
            sigmas = np.broadcast_to(part.factor.sigmas, part.residual.shape)
            expected = sigmas * np.sqrt(np.clip(1.0 - part.leverage, 1e-6, 1.0))
            free = part.factor.steps.free
            if free is not None:  # what binds nothing follows the sensors, and is no deviation
                k = free.shape[1]
                expected[:, :k] = np.where(free > 0.0, sigmas[:, :k], expected[:, :k])
            rates = problem.robot.layout.n_rates
            collected.process.append(((part.residual * sigmas)[:, :rates], expected[:, :rates]))
        elif part.factor.name in collected.series:
            collected.series[part.factor.name].append(SensorResiduals.of(part, problem.robot.sensors[part.factor.name]))
    return collected


def series_of(problem: BagProblem, sensor: Sensor, parts: list[SensorResiduals]) -> ResidualSeries:
    """Residuals of one sensor in the order of time.

    Samples that lack a channel are left out; where several drivers tell of a joint each, NaN stands for the others.
    """
    rows = parts[0].rows
    channels = sensor.channels if set(rows) <= set(sensor.channels) else rows
    units = dict(zip(sensor.channels, sensor.units, strict=True))
    stream = problem.recording.streams[sensor.name]
    times = np.concatenate([p.times for p in problem.sensors if p.factor.name == sensor.name])
    table = np.full((3, len(stream), len(channels)), np.nan)
    sums, start = np.zeros((2, len(channels))), 0
    for part in parts:
        index = np.searchsorted(stream.times, times[start : start + len(part.residual)])
        columns = np.array([channels.index(row) for row in part.rows], dtype=np.intp)
        table[0][np.ix_(index, columns)], table[1][np.ix_(index, columns)] = part.residual, part.expected
        sums[0, columns] += part.squares
        sums[1, columns] += part.freedom
        start += len(part.residual)
    table[2] = stream.values if len(channels) == stream.values.shape[1] else 0.0
    each = np.all(np.isfinite(table), axis=0)
    seen = each.all(axis=1)
    if np.count_nonzero(seen) < WHOLE * np.count_nonzero(each, axis=0).max():
        seen = each.any(axis=1)
        typical = [np.median(table[1][each[:, j], j]) if each[:, j].any() else 1.0 for j in range(len(channels))]
        table[1] = np.where(each, table[1], typical)
    residual, expected, measured = table[:, seen]
    return ResidualSeries(
        channels=channels,
        units=tuple(units.get(channel, sensor.units[0]) for channel in channels),
        times=stream.times[seen],
        measured=measured,
        predicted=measured + residual,
        sigma=expected,
        chi2=sums[0] / sums[1],
    )
