# SPDX-License-Identifier: BSD-3-Clause
"""Uncertainty of states and shared values after a batch solve.

With A = L L' the blocks of A^-1 that lie on and beside the diagonal follow from the last state backwards
(Rauch-Tung-Striebel in information form):

    P(k, k)   = N(k) + C(k)' P(k+1, k+1) C(k),    P(k, k+1) = -C(k)' P(k+1, k+1)
    C(k)      = L(k+1, k) L(k, k)^-1,             N(k) = L(k, k)^-T L(k, k)^-1

The shared values widen them: x moves by -X dp for a change dp, X = A^-1 B.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor
from jointscope.graphs.solving.banded_solver import Elimination, eliminations_of
from jointscope.graphs.solving.batch_solver import Solution, free_indices, reduced_system
from jointscope.graphs.solving.normal_equations import CHUNK, Linearized, whitened
from jointscope.graphs.solving.set_problem import Problem
from jointscope.graphs.solving.solver_context import side_by_side
from jointscope.graphs.solving.unobservable import unobservable

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StateSpread:
    """Variances of one recording's states.

    Attributes:
        given_shared: of each state for known shared values, shape (m, d).
        response: X = A^-1 B, change of each state against the shared values, shape (m, d, p).
        shared: covariance of this recording's shared values, shape (p, p).
    """

    given_shared: Array
    response: Array
    shared: Array

    @property
    def sigmas(self) -> Array:
        """Standard deviation of every state component, shape (m, d)."""
        found = self.given_shared.copy()
        for start in range(0, len(found), CHUNK):
            X = self.response[start : start + CHUNK]
            found[start : start + CHUNK] += np.sum((X @ self.shared) * X, axis=2)
        return np.sqrt(found)


@dataclass(frozen=True)
class StatePosterior:
    """Covariance of one recording's states.

    Attributes:
        given_shared: covariance of each state for known shared values, shape (m, d, d).
        neighbours: covariance of X(k) with X(k+1) for known shared values, shape (m - 1, d, d).
        response: X = A^-1 B, change of each state against the shared values, shape (m, d, p).
        shared: covariance of this recording's shared values, shape (p, p).
    """

    given_shared: Array
    neighbours: Array
    response: Array
    shared: Array

    @staticmethod
    def of(elimination: Elimination, shared: Array) -> StatePosterior:
        """Backward recursion over the factorised chain."""
        from jointscope.graphs.kernels.selected_inverse import selected_inverse  # numba takes half a second to import

        m, d, _ = elimination.columns.shape
        P, neighbours = np.empty((m, d, d)), np.empty((max(m - 1, 0), d, d))

        def inverse() -> Array:
            selected_inverse(elimination.columns, P, neighbours)
            return P

        def response() -> Array:
            return elimination.solve_transposed(elimination.W).reshape(m, d, elimination.W.shape[1])

        _, X = side_by_side(lambda task: task(), (inverse, response), threads=0 if m > CHUNK else 1)
        return StatePosterior(P, neighbours, X, shared)

    @property
    def spread(self) -> StateSpread:
        """What is left of it where only standard deviations are wanted."""
        return StateSpread(np.einsum("kii->ki", self.given_shared).copy(), self.response, self.shared)

    @property
    def sigmas(self) -> Array:
        """Standard deviation of every state component, shape (m, d)."""
        return self.spread.sigmas

    def covariance(self, tick: int) -> Array:
        """Full covariance of one state, shape (d, d)."""
        X = self.response[tick]
        return self.given_shared[tick] + X @ self.shared @ X.T


def posteriors(
    problems: Sequence[Problem],
    solution: Solution,
    hold: Sequence[str] = (),
    eliminations: Sequence[Elimination] | None = None,
) -> tuple[list[StatePosterior], Array]:
    """Uncertainty of all recordings at a solution, and the covariance of all shared values.

    Args:
        problems: the recordings.
        solution: where the solver ended.
        hold: blocks that were held; they have no uncertainty.
        eliminations: of the solution's systems, where they are there already.

    Raises:
        SolveError: the Hessian is not positive definite.
    """
    shared = solution.shared
    if eliminations is None:
        eliminations = eliminations_of(problems, solution.estimate)
    H, _ = reduced_system(problems, eliminations, shared, solution.estimate.calibrations)
    free = free_indices(shared, hold)
    covariance = np.zeros_like(H)
    try:
        covariance[np.ix_(free, free)] = cho_solve(cho_factor(H[np.ix_(free, free)]), np.eye(len(free)))
    except np.linalg.LinAlgError as err:
        raise unobservable(H, free, shared, solution.estimate.calibrations[0]) from err

    def posterior(i: int) -> StatePosterior:
        index = shared.indices(i)
        return StatePosterior.of(eliminations[i], covariance[np.ix_(index, index)])

    return list(side_by_side(posterior, range(len(eliminations)))), covariance


@dataclass(frozen=True)
class ResidualPart:
    """Whitened residuals of some samples of a factor and what the estimate makes of them.

    Attributes:
        factor: the samples.
        ticks: first state of each sample.
        residual: whitened, shape (m, r).
        leverage: share of each row's variance that the fit absorbs, in [0, 1], shape (m, r).
        by_shared: derivative of the residual by the shared values, with states following along, shape (m, r, p).
    """

    factor: Factor
    ticks: NDArray[np.intp]
    residual: Array
    leverage: Array
    by_shared: Array


def residual_parts(
    linearized: Iterable[Linearized], calibration: Calibration, posterior: StatePosterior
) -> Iterator[ResidualPart]:
    """Residuals of linearised factors with leverage and score.

    Args:
        linearized: factors of one recording, linearised at the estimate.
        calibration: gives the layout of the shared values.
        posterior: uncertainty of the recording's states.
    """
    from jointscope.graphs.kernels.selected_inverse import absorb  # as above

    columns = calibration.columns
    p = posterior.shared.shape[0]

    def part(piece: Linearized) -> ResidualPart:
        factor, ticks, linear = piece
        r, J, by_block = whitened(factor, linear)
        by_shared, leverage = np.zeros((*r.shape, p)), np.zeros(r.shape)
        for block, J_block in by_block.items():
            by_shared[:, :, columns[block]] = J_block
        none = np.zeros((0, r.shape[1], posterior.given_shared.shape[1]))
        sides = (np.ascontiguousarray(J_i) for J_i in (*J, none, none)[:2])
        known = (posterior.given_shared, posterior.neighbours, posterior.response, posterior.shared)
        absorb(*sides, np.asarray(ticks, dtype=np.intp), *map(np.ascontiguousarray, known), by_shared, leverage)
        return ResidualPart(factor, ticks, r, leverage, by_shared)

    threads = 0 if len(posterior.given_shared) > CHUNK else 1  # handing over takes longer than what is short
    yield from side_by_side(part, linearized, threads)
