# SPDX-License-Identifier: BSD-3-Clause
"""Filtered states at all ticks: what is known at a tick from data up to that tick only.

`filter_covariance` reads them off the forward half of the banded factorisation: with A = L L', w = L^-1 g, and without
what reaches on to later states,

    information  D(k) - D_next(k) - L(k, k-1) L(k, k-1)',   gradient  g(k) - g_next(k) - L(k, k-1) w(k-1)

which is quick, but linearised around smoothed states: the future has a small say. `filter_states` is an extended Kalman
filter in information form, linearised around its own past. A guess of its means gives all its linear steps at once,
these give better means, and what stays the same is the filter. Where that does not settle, it runs tick by tick, many
pieces of the recording side by side, each started early enough to forget where it began, and where most is known: a
link that rests somewhere in its backlash is anywhere in it, and linear steps from there may learn a side that is wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor
from jointscope.graphs.comparison.prediction import Predictor
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.sensor_placement import Placed
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.normal_equations import CHUNK, add_at, build, whitened
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]

PIECE = 0.5  # [s] of filtered states from each run
SETTLED, ROUNDS = 1e-4, 10  # [sigma] largest change of the last round, the next is a tenth; rounds at the most
SHRINKS, ROUNDING = 0.5, 0.02  # of the round before; [sigma] changes that no longer do so and are rounding
BURN_IN = 0.5  # [s] that each run starts earlier; a state is forgotten within a few tenths of a second


@dataclass(frozen=True)
class FilteredStates:
    """Causal estimates.

    Attributes:
        mean: states, shape (m, d).
        covariance: shape (m, d, d).
    """

    mean: Array
    covariance: Array


def filter_states(problem: BagProblem, calibration: Calibration, x: Array) -> FilteredStates:
    """Extended Kalman filter over a recording with known shared values.

    Args:
        problem: the factors, with the noise to use; fastest of a robot whose parameters are held.
        calibration: shared values; biases are those of the recording.
        x: smoothed states, shape (m, d); only the starts of the pieces come from a filter linearised around them.

    Raises:
        SolveError: the filter ran away, as it may under a model that contradicts the recording.
    """
    try:
        begin = filter_around(problem, x, calibration)
        return _settled(problem, begin, calibration) or _tick_by_tick(problem, begin, calibration)
    except np.linalg.LinAlgError as err:
        raise SolveError(
            f"{problem.robot.name} cannot follow the recording: the filter of its states ran away; the model "
            "contradicts the recording: check rigid_joints, start values and units"
        ) from err


def _settled(problem: BagProblem, begin: FilteredStates, calibration: Calibration) -> FilteredStates | None:
    """Rounds of linear steps, stretch by stretch, until the means are those around which they were linearised.

    None where a stretch does not settle, or leaves the numbers.
    """
    from jointscope.graphs.kernels.filter_kernel import filter_steps

    predictor = Predictor(problem.robot, problem.timeline)
    mean, information = begin.mean.copy(), np.empty_like(begin.covariance)
    known_from = int(np.argmax(np.all(np.isfinite(begin.covariance), axis=(1, 2))))  # sensors may begin later
    information[: known_from + 1] = _inverse(begin.covariance[: known_from + 1])
    for first in range(known_from, len(mean) - 1, CHUNK):
        ticks = np.arange(first, min(first + CHUNK, len(mean) - 1))
        own = slice(first, first + len(ticks) + 1)
        before = np.inf
        for _ in range(ROUNDS):
            H, g, ahead = _linear_steps(problem, predictor, mean, ticks, calibration)
            found, known, good = filter_steps(H, g, mean[own], ahead, mean[first], information[first])
            if not good:  # the rest was never written
                return None
            change = np.abs(found - mean[own]) * np.sqrt(np.einsum("kii->ki", known))
            if not np.all(np.isfinite(change)):
                return None
            mean[own], information[own] = found, known
            now = float(np.max(change))
            if now < SETTLED or SHRINKS * before < now < ROUNDING:
                break
            before = now
        else:
            return None
    return FilteredStates(mean, _inverse(information))


def _linear_steps(
    problem: BagProblem, predictor: Predictor, mean: Array, ticks: NDArray[np.intp], calibration: Calibration
) -> tuple[Array, Array, Array]:
    """What steps that follow each other add to Hessian and gradient on (old state, new state), and the new states."""
    d, first, last = mean.shape[1], ticks[0], ticks[-1]
    ahead = predictor.advance(mean[ticks], ticks)
    H, g = np.zeros((len(ticks), 2 * d, 2 * d)), np.zeros((len(ticks), 2 * d))
    _add(H, g, problem.dynamics.select(ticks), ticks - first, (mean[ticks], ahead), calibration)
    for placed in problem.sensors:
        # a sample at a tick belongs to the step before it, one between two ticks to the step around it
        one = placed.factor.states == 1
        begin, end = np.searchsorted(placed.ticks, (first + one, last + one + 1))
        step = placed.ticks[begin:end] - one - first
        x = (ahead[step],) if one else (mean[first + step], ahead[step])
        _add(H, g, placed.factor.select(slice(begin, end)), step, x, calibration)
    return H, g, ahead


def _tick_by_tick(problem: BagProblem, begin: FilteredStates, calibration: Calibration) -> FilteredStates:
    m, h = len(begin.mean), float(np.median(problem.timeline.h))
    piece, early = max(int(PIECE / h), 1), int(BURN_IN / h)
    start = _starts(begin, np.arange(0, m, piece), early)
    mean, covariance = begin.mean.copy(), begin.covariance.copy()
    run = _Run(problem, calibration, begin.mean[start], _inverse(begin.covariance[start]), start)
    for _ in range(piece + early - 1):
        alive = run.tick + 1 < m
        if not np.any(alive):
            break
        run = run.keep(alive).advance()
        wanted = run.tick // piece == run.owner
        mean[run.tick[wanted]] = run.mean[wanted]
        covariance[run.tick[wanted]] = _inverse(run.information[wanted])
    return FilteredStates(mean, covariance)


def _starts(begin: FilteredStates, first: NDArray[np.intp], early: int) -> NDArray[np.intp]:
    """Where each run starts: the tick at which most is known in the first half of what it may run before its piece."""
    with np.errstate(invalid="ignore"):  # rounding may leave a covariance that is none; no run starts there
        balanced, scale = _balanced(begin.covariance)
        spread = np.linalg.slogdet(balanced)[1] - 2.0 * np.log(scale).sum(axis=1)  # logarithm of the determinant
    spread = np.where(np.isfinite(spread), spread, np.inf)
    sooner, later = np.maximum(first - early, 0), np.maximum(first - early // 2, 0)
    return np.array([a + int(np.argmin(spread[a : b + 1])) for a, b in zip(sooner, later, strict=True)], dtype=np.intp)


def filter_around(problem: BagProblem, x: Array, calibration: Calibration) -> FilteredStates:
    """Filtered states linearised around given ones: exact covariances, means that know a little of the future.

    Args:
        problem: the factors, with the noise to use.
        x: states to linearise around, shape (m, d).
        calibration: shared values; biases are those of the recording.
    """
    system = build(problem, x, calibration, split=True)
    assert system.D_next is not None and system.g_next is not None
    elimination = eliminate(system)
    _, L_below = elimination.blocks()
    w = elimination.w.reshape(x.shape)
    information = system.D - system.D_next
    gradient = system.g_x - system.g_next
    information[1:] -= L_below @ L_below.transpose(0, 2, 1)
    gradient[1:] -= (L_below @ w[:-1, :, None])[:, :, 0]
    covariance = _inverse(information)
    return FilteredStates(x - (covariance @ gradient[:, :, None])[:, :, 0], covariance)


class _Run:
    """Several filters at different ticks that advance together."""

    def __init__(
        self, problem: BagProblem, calibration: Calibration, mean: Array, information: Array, tick: NDArray[np.intp]
    ):
        self.mean, self.information, self.tick = mean, information, tick
        self.owner = np.arange(len(tick))
        self._problem, self._calibration = problem, calibration
        self._predictor = Predictor(problem.robot, problem.timeline)
        self._samples = [(placed, _rows_by_tick(placed, problem)) for placed in problem.sensors]

    def keep(self, chosen: NDArray[np.bool_]) -> _Run:
        """Only some of the filters."""
        if not np.all(chosen):
            self.mean, self.information = self.mean[chosen], self.information[chosen]
            self.tick, self.owner = self.tick[chosen], self.owner[chosen]
        return self

    def advance(self) -> _Run:
        """One tick: predict, take in the samples up to the next tick, drop the old state."""
        x0, d = self.mean, self.mean.shape[1]
        x1 = self._predictor.advance(x0, self.tick)
        H = np.zeros((len(x0), 2 * d, 2 * d))
        g = np.zeros((len(x0), 2 * d))
        H[:, :d, :d] = self.information
        everyone = np.arange(len(x0))
        _add(H, g, self._problem.dynamics.select(self.tick), everyone, (x0, x1), self._calibration)
        for placed, (first, count) in self._samples:
            # a sample at a tick belongs to the step before it, one between two ticks to the step around it
            at = self.tick + (1 if placed.factor.states == 1 else 0)
            for j in range(int(np.max(count[at], initial=0))):
                who = np.flatnonzero(count[at] > j)
                factor = placed.factor.select(first[at[who]] + j)
                _add(H, g, factor, who, (x1[who],) if factor.states == 1 else (x0[who], x1[who]), self._calibration)
        H, scale = _balanced(H)
        g = g * scale
        gain = np.linalg.solve(H[:, :d, :d], np.concatenate([H[:, :d, d:], g[:, :d, None]], axis=2))
        information = H[:, d:, d:] - H[:, d:, :d] @ gain[:, :, :d]
        gradient = g[:, d:] - (H[:, d:, :d] @ gain[:, :, d:])[:, :, 0]
        step = np.linalg.solve(information, gradient[:, :, None])[:, :, 0]
        self.mean = x1 - step * scale[:, d:]
        self.information = information / (scale[:, d:, None] * scale[:, None, d:])
        self.tick = self.tick + 1
        return self


def _add(
    H: Array, g: Array, factor: Factor, who: NDArray[np.intp], x: tuple[Array, ...], calibration: Calibration
) -> None:
    """Adds samples to the systems of their filters or steps, of which one may have several."""
    r, J, _ = whitened(factor, factor.linearize(x, calibration))
    full = np.concatenate(J, axis=2)
    columns = slice(g.shape[1] - full.shape[2], None)
    transposed = full.transpose(0, 2, 1)
    add_at(H[:, columns, columns], who, transposed @ full)
    add_at(g[:, columns], who, (transposed @ r[:, :, None])[:, :, 0])


def _rows_by_tick(placed: Placed, problem: BagProblem) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First sample and number of samples of every tick."""
    ticks = np.arange(len(problem.timeline.ticks))
    first = np.searchsorted(placed.ticks, ticks, side="left")
    return first, np.searchsorted(placed.ticks, ticks, side="right") - first


def _balanced(H: Array) -> tuple[Array, Array]:
    """Matrices scaled to a unit diagonal, and the scale: their rows differ by ten orders of magnitude.

    Not a number where the diagonal is not positive, as that of a state of which nothing is known.
    """
    diagonal = np.einsum("kii->ki", H)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, np.nan))
    balanced = H * scale[:, :, None] * scale[:, None, :]
    return 0.5 * (balanced + balanced.transpose(0, 2, 1)), scale


def _inverse(matrices: Array) -> Array:
    """Inverse of symmetric positive matrices with rows of very different size."""
    balanced, scale = _balanced(matrices)
    return np.linalg.inv(balanced) * scale[:, :, None] * scale[:, None, :]
