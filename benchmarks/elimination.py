# SPDX-License-Identifier: BSD-3-Clause
"""The linear system alone: banded LAPACK against GTSAM's elimination of the very same linearised factors."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

import gtsam
import numpy as np

from jointscope.factors.factor import Factor
from jointscope.factors.priors import shared_priors
from jointscope.factors.single import block_key, state_key
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.batch_solver import NewtonStep, Solution, newton_step
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import Linearized, accumulate, linearize_all, whitened
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.solver_context import in_solver_context

REPEATS = 3


@dataclass(frozen=True)
class EliminationTimes:
    """Seconds for one solution of the linear system, and whether both found the same.

    Attributes:
        ticks: number of states.
        accumulate: normal equations from linearised factors [s].
        banded: factorisation, Schur complement and back-substitution [s].
        gtsam: by GTSAM, which forms its Hessians on the way, by name of the function [s].
        difference: largest difference of the two steps, relative to the largest step of that component.
    """

    ticks: int
    accumulate: float
    banded: float
    gtsam: dict[str, float]
    difference: float


@in_solver_context  # as in `calibrate`; GTSAM does not use BLAS
def measure(problem: BagProblem, estimate: Estimate) -> EliminationTimes:
    """Solves one linear system in both ways."""
    x, calibration = estimate.states[0], estimate.calibrations[0]
    linearized = list(linearize_all(problem, x, calibration))
    system, accumulating = _fastest(lambda: accumulate(linearized, x, calibration))
    solution = Solution(estimate, system.cost, SharedLayout.of(calibration, 1))
    step, banded = _fastest(lambda: newton_step([problem], solution, eliminations=[eliminate(system)]))
    graph = jacobian_graph(problem, linearized, estimate)
    ordering = chain_ordering(len(x), estimate)
    found, multifrontal = _fastest(lambda: graph.optimize(ordering))
    _, sequential = _fastest(lambda: graph.eliminateSequential(ordering).optimize())
    times = {"multifrontal Cholesky": multifrontal, "sequential Cholesky": sequential}
    return EliminationTimes(len(x), accumulating, banded, times, _difference(step, found, len(x)))


def jacobian_graph(
    problem: BagProblem, linearized: Iterable[Linearized], estimate: Estimate
) -> gtsam.GaussianFactorGraph:
    """The same linearised factors as GTSAM's JacobianFactors, one per sample."""
    graph = gtsam.GaussianFactorGraph()
    calibration = estimate.calibrations[0]
    priors: list[Linearized] = [
        (prior, np.zeros(1, np.intp), prior.linearize((), calibration)) for prior in shared_priors(problem.robot)
    ]
    for factor, ticks, linear in (*linearized, *priors):
        residual, by_state, by_block = whitened(factor, linear)
        blocks = {block_key(block, calibration): np.ascontiguousarray(J) for block, J in by_block.items()}
        for k in range(len(residual)):
            terms = [(state_key(int(ticks[k]) + i), J[k]) for i, J in enumerate(by_state)]
            terms += [(key, J[k]) for key, J in blocks.items()]
            graph.add(_jacobian_factor(factor, terms, -residual[k]))
    return graph


def chain_ordering(ticks: int, estimate: Estimate) -> gtsam.Ordering:
    """States in the order of time, shared values last."""
    ordering = gtsam.Ordering()
    for tick in range(ticks):
        ordering.push_back(state_key(tick))
    calibration = estimate.calibrations[0]
    for block in calibration.blocks:
        ordering.push_back(block_key(block, calibration))
    return ordering


def _jacobian_factor(factor: Factor, terms: list[tuple[int, np.ndarray]], right: np.ndarray) -> gtsam.JacobianFactor:
    if not 1 <= len(terms) <= 3:
        raise AssertionError(f"{factor.name}: expected one to three variables, got {len(terms)}")
    flat = [part for key, J in terms for part in (key, np.asfortranarray(J))]
    return gtsam.JacobianFactor(*flat, right, gtsam.noiseModel.Unit.Create(len(right)))


def _difference(step: NewtonStep, found: gtsam.VectorValues, ticks: int) -> float:
    ours = step.dx[0]
    theirs = np.array([found.at(state_key(tick)) for tick in range(ticks)])
    return float(np.max(np.abs(ours - theirs) / np.abs(ours).max(axis=0)))


def _fastest(work):
    """Result and shortest time of some runs."""
    seconds = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - started)
    return result, min(seconds)
