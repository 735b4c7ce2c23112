# SPDX-License-Identifier: BSD-3-Clause
"""The Hessian on base parameters and hypotheses with all states eliminated: one elimination for all of them.

Regressors of hypotheses are further columns beside the shared values. With A = L L' for the states,

    H = C - W' W,   g = g_p - W' w,   W = L^-1 B,   w = L^-1 g_x

on (shared values, hypotheses). Nothing is solved anew for a hypothesis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from jointscope.factors.calibration import Calibration
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Factor, Linearization
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.factors.step import Steps
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.column import Column, SensorPart
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.solving.banded_solver import Elimination, eliminate
from jointscope.graphs.solving.normal_equations import Linearized, accumulate, add_at, linearize_all, whitened
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]
Whitened = tuple[Array, tuple[Array, ...], dict[str, Array]]
"""Residual, shape (s, r), derivatives by states, shape (s, r, d) each, and by blocks, shape (s, r, size)."""


@dataclass(frozen=True)
class Segment:
    """One recording, linearised at its solution; everything that does not depend on the hypotheses.

    Attributes:
        problem: the factors.
        calibration: shared values.
        signals: what regressors are built from.
        linearized: all factors.
        stamps: of the samples of each linearised piece, shape (s,) [s]; empty for the dynamics.
        elimination: of the states.
    """

    problem: BagProblem
    calibration: Calibration
    signals: ScoreSignals
    linearized: list[Linearized]
    stamps: list[Array]
    elimination: Elimination

    @staticmethod
    def of(problem: BagProblem, x: Array, calibration: Calibration) -> Segment:
        """Linearises a solved recording."""
        linearized = list(linearize_all(problem, x, calibration))
        placed = iter(np.concatenate([np.zeros(0), *(p.times for p in problem.placed)]))
        stamps = []
        for factor, _, _ in linearized:
            count = 0 if isinstance(factor, DynamicsFactor) else len(factor)
            stamps.append(np.array([next(placed) for _ in range(count)]))
        elimination = eliminate(accumulate(linearized, x, calibration))
        return Segment(problem, calibration, ScoreSignals.of(problem, x, calibration), linearized, stamps, elimination)

    @cached_property
    def middle(self) -> tuple[ScoreSignals, Array] | None:
        """As `ScoreSignals.between`; None for other rules than Simpson's, which do not look there."""
        if not isinstance(self.problem.dynamics, SimpsonDynamics):
            return None
        return ScoreSignals.between(self.problem, self.signals.x, self.calibration)

    @cached_property
    def whitened(self) -> list[Whitened]:
        """Residual and derivatives of every piece of `linearized`, whitened; the same for every batch of hypotheses."""
        return [whitened(factor, linear) for factor, _, linear in self.linearized]

    def with_noise(self, noise: ProcessNoise) -> Segment:
        """The same with another process noise; only weights change."""
        linearized: list[Linearized] = [
            (factor.with_noise(noise) if isinstance(factor, DynamicsFactor) else factor, ticks, linear)
            for factor, ticks, linear in self.linearized
        ]
        elimination = eliminate(accumulate(linearized, self.signals.x, self.calibration))
        return replace(self, problem=self.problem.with_noise(noise), linearized=linearized, elimination=elimination)


@dataclass(frozen=True)
class ScoreRows:
    """Whitened rows of some factor samples: the residual and its derivatives.

    Attributes:
        ticks: first state of each sample, shape (s,).
        residual: shape (s, r).
        by_state: shape (s, r, d) each.
        by_block: derivative by the shared values, block by block.
        by_size: derivative by the sizes of the hypotheses, shape (s, r, k).
    """

    ticks: NDArray[np.intp]
    residual: Array
    by_state: tuple[Array, ...]
    by_block: dict[str, Array]
    by_size: Array


def rows_of(segment: Segment, columns: Sequence[Column]) -> list[ScoreRows]:
    """All rows that a hypothesis may touch: dynamics and sensors."""
    at_ticks, in_steps, reading = (
        [i for i, c in enumerate(columns) if getattr(c, kind) is not None]
        for kind in ("at_ticks", "in_steps", "reading")
    )
    stacked = _stacked([columns[i].at_ticks for i in at_ticks]), _stacked([columns[i].in_steps for i in in_steps])
    between = _stacked([columns[i].between for i in at_ticks])
    found = []
    pieces = zip(segment.linearized, segment.whitened, segment.stamps, strict=True)
    for (factor, ticks, linear), (r, J, by_block), stamps in pieces:
        if factor.states == 0 or factor.name == "initial_state":
            continue
        if isinstance(factor, DynamicsFactor):
            by_size = np.zeros((*r.shape, len(columns)))
            if at_ticks:
                ends = stacked[0][ticks], stacked[0][ticks + 1]
                if segment.middle is not None and between.shape[2] == len(at_ticks):
                    by_size[:, :, at_ticks] = _simpson(factor.steps, *ends, between[ticks], segment.middle[1][ticks])
                else:
                    by_size[:, :, at_ticks] = _defects(factor.steps, *ends)
            for i, column in enumerate(columns):
                if column.better_integrator:
                    by_size[:, :, i] = _what_simpson_adds(segment, factor, ticks, linear)
            if in_steps:
                by_size[:, :, in_steps] = _defects(factor.steps, stacked[1][ticks], stacked[1][ticks])
        elif reading and _reads_channels(segment, factor):
            part = _sensor_part(segment, factor, ticks, linear, stamps)
            by_size = np.zeros((*r.shape, len(columns)))
            for i in reading:
                evaluate = columns[i].reading
                assert evaluate is not None
                by_size[:, :, i] = evaluate(part)
        else:
            continue
        by_size /= np.broadcast_to(factor.sigmas, r.shape)[:, :, None]
        found.append(ScoreRows(ticks, r, J, by_block, by_size))
    return found


@dataclass(frozen=True)
class HypothesisSystem:
    """Reduced system of one segment on its shared values (p of them) and k sizes of hypotheses.

    Attributes:
        H: Hessian, shape (p + k, p + k).
        g: gradient, shape (p + k,).
        W: L^-1 B of the hypotheses, shape (m d, k).
    """

    H: Array
    g: Array
    W: Array


def hypothesis_system(segment: Segment, rows: Sequence[ScoreRows], k: int) -> HypothesisSystem:
    """Eliminates the states from the hypotheses' columns.

    Args:
        segment: the recording.
        rows: as `rows_of` gives them.
        k: number of columns.
    """
    base = segment.elimination
    m, d, p = len(base.W) // base.d, base.d, base.W.shape[1]
    # LAPACK wants column after column
    B, C_pk, C_kk, g_k = np.zeros((k, m, d)).transpose(1, 2, 0), np.zeros((p, k)), np.zeros((k, k)), np.zeros(k)
    columns = segment.calibration.columns
    for part in rows:
        flat = part.by_size.reshape(-1, k)
        C_kk += flat.T @ flat
        g_k += flat.T @ part.residual.ravel()
        for block, J in part.by_block.items():
            C_pk[columns[block]] += J.reshape(len(flat), J.shape[2]).T @ flat
        for i, J in enumerate(part.by_state):
            add_at(B, part.ticks + i, J.transpose(0, 2, 1) @ part.by_size)
    W, info = lapack.dtbtrs(base.L, B.reshape(m * d, k), uplo="L", overwrite_b=1)
    assert info == 0
    H = np.block([[base.S, C_pk - base.W.T @ W], [(C_pk - base.W.T @ W).T, C_kk - W.T @ W]])
    return HypothesisSystem(H, np.concatenate([base.s, g_k - W.T @ base.w]), W)


def _defects(steps: Steps, first: Array, last: Array) -> Array:
    """Rows of the dynamics for accelerations at both ends of each step, shape (s, rows, k)."""
    h = steps.h[:, None, None]
    positions = len(steps.layout.positions)
    d_q = -(h**2) / 12.0 * (first - last)[:, :positions]
    return steps.combine(-0.5 * h * (first + last), d_q)


def _simpson(steps: Steps, first: Array, last: Array, middle: Array, by_rates: Array) -> Array:
    """The same by Simpson's rule, whose middle moves along; shape (s, rows, k).

    Args:
        steps: their lengths and noise.
        first: accelerations where each step begins, shape (s, r, k).
        last: the same where it ends.
        middle: the same between.
        by_rates: derivative of all accelerations by the rates in the middle, shape (s, r, r).
    """
    h = steps.h[:, None, None]
    moved = middle + by_rates @ (h / 8.0 * (first - last))
    d_q = -(h**2) / 12.0 * (first - last)[:, : len(steps.layout.positions)]
    return steps.combine(-h / 6.0 * (first + 4.0 * moved + last), d_q)


def _what_simpson_adds(
    segment: Segment, factor: DynamicsFactor, ticks: NDArray[np.intp], linear: Linearization
) -> Array:
    """Defects by Simpson's rule minus those of the model's own, shape (s, rows)."""
    simpson = SimpsonDynamics(factor.model, factor.steps, factor.joints)
    x = segment.signals.x
    return simpson.residual((x[ticks], x[ticks + 1]), segment.calibration) - linear.residual


def _stacked(parts: list[Array | None]) -> Array:
    there = [part for part in parts if part is not None]
    return np.stack(there, axis=2) if there else np.zeros((0, 0, 0))


def _reads_channels(segment: Segment, factor: Factor) -> bool:
    """Whether rows are channels of a sensor, not combinations of them, of which errors of channels are not known."""
    return set(factor.rows) <= set(segment.problem.robot.sensors[factor.name].channels)


def _sensor_part(
    segment: Segment, factor: Factor, ticks: NDArray[np.intp], linear: Linearization, stamps: Array
) -> SensorPart:
    robot, rate = segment.problem.robot, segment.signals.rate
    sensor = robot.sensors[factor.name]
    channels = np.array([sensor.channels.index(row) for row in factor.rows], dtype=np.intp)
    stream = segment.problem.recording.streams[factor.name]
    measured = stream.values[np.searchsorted(stream.times, stamps)][:, channels]
    biases = segment.calibration.biases
    zero = biases[factor.name] if factor.name in biases else getattr(sensor, "zero", 0.0)
    offset = np.broadcast_to(zero, len(sensor.channels))
    motion = sum((J @ rate[ticks + i][:, :, None])[:, :, 0] for i, J in enumerate(linear.by_state))
    reading = linear.residual + measured - offset[channels]
    q, a = segment.problem.robot.layout.positions, rate[:, segment.problem.robot.layout.velocities]
    bend = sum((J[:, :, q] @ a[ticks + i][:, :, None])[:, :, 0] for i, J in enumerate(linear.by_state))
    return SensorPart(factor.name, channels, stamps, reading, np.asarray(motion), np.asarray(bend))
