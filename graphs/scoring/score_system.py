# SPDX-License-Identifier: BSD-3-Clause
"""A solved recording, linearised, and the rows that hypotheses touch in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Factor, Linearization
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.column import Column, SensorPart
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.solving.banded_solver import Elimination, eliminate
from jointscope.graphs.solving.normal_equations import Linearized, accumulate, linearize_all
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]


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
    def of(problem: BagProblem, x: Array, calibration: Calibration, elimination: Elimination | None = None) -> Segment:
        """Linearises a solved recording; its states may have been eliminated already."""
        linearized = list(linearize_all(problem, x, calibration))
        times, placed, stamps = np.concatenate([np.zeros(0), *(p.times for p in problem.placed)]), 0, []
        for factor, _, _ in linearized:
            count = 0 if isinstance(factor, DynamicsFactor) else len(factor)
            stamps.append(times[placed : placed + count])
            placed += count
        elimination = elimination or eliminate(accumulate(linearized, x, calibration))
        return Segment(problem, calibration, ScoreSignals.of(problem, x, calibration), linearized, stamps, elimination)

    @cached_property
    def middle(self) -> tuple[ScoreSignals, Array] | None:
        """As `ScoreSignals.between`; None for other rules than Simpson's, which do not look there."""
        if not isinstance(self.problem.dynamics, SimpsonDynamics):
            return None
        return ScoreSignals.between(self.problem, self.signals.x, self.calibration)

    @cached_property
    def ends(self) -> ScoreSignals:
        """As `ScoreSignals.at_ends`."""
        return ScoreSignals.at_ends(self.problem, self.signals.x, self.calibration)

    @cached_property
    def readings(self) -> list[SensorPart | None]:
        """What regressors of readings ask of every piece of `linearized`; None for pieces that are no channels."""
        pieces = zip(self.linearized, self.stamps, strict=True)
        return [_sensor_part(self, *piece, stamps) if self._reads(piece[0]) else None for piece, stamps in pieces]

    @property
    def preparations(self) -> tuple[Callable[[], object], ...]:
        """What finds all that hypotheses need, to be called before threads ask for it; each may have a thread."""
        return lambda: self.middle, lambda: self.ends, lambda: self.readings

    def _reads(self, factor: Factor) -> bool:
        """Whether rows are channels of a sensor; of combinations of them, errors of channels are not known."""
        sensors = self.problem.robot.sensors
        return factor.name in sensors and set(factor.rows) <= set(sensors[factor.name].channels)

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
    """Rows of some factor samples: the residual and its derivatives, all whitened.

    Attributes:
        ticks: first state of each sample, shape (s,).
        weights: of the rows, one over their sigmas, shape (s, r).
        linear: residual and derivatives before they are whitened.
        by_size: derivative by the sizes of the hypotheses, shape (s, r, k).
    """

    ticks: NDArray[np.intp]
    weights: Array
    linear: Linearization
    by_size: Array

    @property
    def residual(self) -> Array:
        """Shape (s, r)."""
        return self.linear.residual * self.weights

    @property
    def by_state(self) -> tuple[Array, ...]:
        """Derivatives by the states of each sample, shape (s, r, d) each."""
        return tuple(J * self.weights[:, :, None] for J in self.linear.by_state)

    @property
    def by_block(self) -> dict[str, Array]:
        """Derivative by the shared values, block by block."""
        return {block: J * self.weights[:, :, None] for block, J in self.linear.by_block.items()}


def rows_of(segment: Segment, columns: Sequence[Column]) -> list[ScoreRows]:
    """All rows that a hypothesis may touch: dynamics and sensors."""
    every = range(len(segment.linearized))
    return [rows for rows in (_rows(segment, i, columns) for i in every) if rows is not None]


def rows_in_time(segment: Segment, columns: Sequence[Column]) -> Iterator[ScoreRows]:
    """The same, pieces that begin earlier first; only one of them exists at a time."""
    order = sorted(range(len(segment.linearized)), key=lambda i: _first_tick(segment.linearized[i][1]))
    yield from (rows for rows in (_rows(segment, i, columns) for i in order) if rows is not None)


def _first_tick(ticks: NDArray[np.intp]) -> int:
    return int(ticks.min()) if len(ticks) else 0


def _rows(segment: Segment, piece: int, columns: Sequence[Column]) -> ScoreRows | None:
    """Rows of one linearised piece; None where no hypothesis touches it."""
    factor, ticks, linear = segment.linearized[piece]
    if factor.states == 0 or factor.name == "initial_state":
        return None
    by_size = np.zeros((*linear.residual.shape, len(columns)))
    if isinstance(factor, DynamicsFactor):
        _add_dynamics(segment, factor, ticks, linear, columns, by_size)
    else:
        reading, part = [i for i, c in enumerate(columns) if c.reading is not None], segment.readings[piece]
        if not reading or part is None:
            return None
        for i in reading:
            evaluate = columns[i].reading
            assert evaluate is not None
            by_size[:, :, i] = evaluate(part)
    weights = 1.0 / np.broadcast_to(factor.sigmas, linear.residual.shape)
    by_size *= weights[:, :, None]
    return ScoreRows(ticks, weights, linear, by_size)


def _add_dynamics(
    segment: Segment,
    factor: DynamicsFactor,
    ticks: NDArray[np.intp],
    linear: Linearization,
    columns: Sequence[Column],
    by_size: Array,
) -> None:
    """What hypotheses do to the defects of some steps, shape (s, rows, k)."""
    at_ticks, in_steps = (
        [i for i, c in enumerate(columns) if getattr(c, kind) is not None] for kind in ("at_ticks", "in_steps")
    )
    if at_ticks:
        first, last = (_at_ends([columns[i] for i in at_ticks], ticks, end) for end in (0, 1))
        between = _stacked([columns[i].between for i in at_ticks], ticks)
        if segment.middle is not None and between.shape[2] == len(at_ticks):
            by_size[:, :, at_ticks] = _simpson(factor, first, last, between, segment.middle[1][ticks])
        else:
            by_size[:, :, at_ticks] = _defects(factor, first, last)
    for i, column in enumerate(columns):
        if column.better_integrator:
            by_size[:, :, i] = _what_simpson_adds(segment, factor, ticks, linear)
    if in_steps:
        held = _stacked([columns[i].in_steps for i in in_steps], ticks)
        by_size[:, :, in_steps] = _defects(factor, held, held)


def _defects(factor: DynamicsFactor, first: Array, last: Array) -> Array:
    """Rows of the dynamics for accelerations at both ends of each step, shape (s, rows, k)."""
    h = factor.steps.h[:, None, None]
    positions = len(factor.steps.layout.positions)
    d_q = -(h**2) / 12.0 * (first - last)[:, :positions]
    return factor.combined(-0.5 * h * (first + last), d_q)


def _simpson(factor: DynamicsFactor, first: Array, last: Array, middle: Array, by_rates: Array) -> Array:
    """The same by Simpson's rule, whose middle moves along; shape (s, rows, k).

    Args:
        factor: of these steps.
        first: accelerations where each step begins, shape (s, r, k).
        last: the same where it ends.
        middle: the same between.
        by_rates: derivative of all accelerations by the rates in the middle, shape (s, r, r).
    """
    from jointscope.graphs.kernels.score_kernel import simpson_columns  # as above

    steps = factor.steps
    d_v, d_q = np.empty_like(first), np.empty((len(first), len(steps.layout.positions), first.shape[2]))
    simpson_columns(steps.h, first, last, middle, np.ascontiguousarray(by_rates), d_v, d_q)
    return factor.combined(d_v, d_q)


def _what_simpson_adds(
    segment: Segment, factor: DynamicsFactor, ticks: NDArray[np.intp], linear: Linearization
) -> Array:
    """Defects by Simpson's rule minus those of the model's own, shape (s, rows)."""
    simpson = SimpsonDynamics(factor.model, factor.steps, factor.joints)
    x = segment.signals.x
    return simpson.residual((x[ticks], x[ticks + 1]), segment.calibration) - linear.residual


def _at_ends(columns: Sequence[Column], ticks: NDArray[np.intp], end: int) -> Array:
    """Where some steps begin (end 0) or end (1), columns side by side, shape (s, r, k)."""
    parts = [(c.at_ticks, ticks + end) if c.at_ends is None or end == 0 else (c.at_ends, ticks) for c in columns]
    return np.stack([part[rows] for part, rows in parts if part is not None], axis=2)


def _stacked(parts: Sequence[Array | None], ticks: NDArray[np.intp]) -> Array:
    """Some rows of columns side by side, shape (s, r, k)."""
    there = [part[ticks] for part in parts if part is not None]
    return np.stack(there, axis=2) if there else np.zeros((0, 0, 0))


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
