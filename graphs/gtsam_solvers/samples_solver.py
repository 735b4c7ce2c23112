# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate --solver samples`: the graph with a factor for every sample, in the hands of GTSAM's own optimizer.

It takes the place of `batch_solver.solve` where recordings are short enough: GTSAM copies all values for each callback.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.single import extract_calibration
from jointscope.graphs.gtsam_solvers.reference_graph import (
    estimate_of,
    free_blocks,
    initial_values,
    marquardt_parameters,
    nonlinear_graph,
    unsolvable,
)
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminations_of
from jointscope.graphs.solving.batch_solver import Progress, Solution, free_indices, reduced_system, total_cost
from jointscope.graphs.solving.convergence import Iteration
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import Problem, motions_only
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]

PER_FACTOR, PER_COPY = 1e-3, 1.4e-6  # [s] of one callback, and of one value that is copied for it; measured
LONGEST = 60.0  # [s] for one iteration


def must_be_short(problems: Sequence[BagProblem]) -> None:
    """Refuses recordings for which an iteration would take minutes.

    Raises:
        SolveError: with what it would cost.
    """
    states = sum(len(p.timeline.ticks) for p in problems)
    factors = sum(len(p.dynamics) + sum(len(placed.factor) for placed in p.placed) for p in problems)
    seconds = factors * (PER_FACTOR + PER_COPY * states)
    if seconds > LONGEST:
        names = ", ".join(p.recording.path for p in problems)
        raise SolveError(
            f"{names}: {states:,} states and {factors:,} samples are too many for `--solver samples`: about "
            f"{seconds / 60.0:.0f} minutes for each of some ten iterations, expected at most {LONGEST / 60.0:.0f}; "
            "time grows with the square: give it a second or two of motion, or leave the option out, which ends in "
            "the same values"
        )


def solve_samples(
    given: Sequence[Problem],
    start: Estimate,
    *,
    max_iterations: int = 30,
    hold: Sequence[str] = (),
    progress: Progress | None = None,
) -> Solution:
    """Minimises with `gtsam.LevenbergMarquardtOptimizer`; arguments and result as of `batch_solver.solve`.

    Raises:
        SolveError: a direction is not determined, or a recording is of another kind than motion.
    """
    problems = motions_only(given, "`--solver samples`")
    parameters = marquardt_parameters()
    parameters.setLinearSolverType("MULTIFRONTAL_QR")
    graph, values = nonlinear_graph(problems, start, hold), initial_values(start, hold)
    path, costs, dampings = [_calibrations(values, start, hold)], list[float](), list[float]()
    try:
        optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters)
        costs.append(optimizer.error())
        while len(costs) <= max_iterations and not _at_rest(costs, parameters):
            if progress:
                progress(f"GTSAM, iteration {len(costs)}, cost {costs[-1]:.6g}", len(costs) / max_iterations)
            dampings.append(optimizer.lambda_())
            optimizer.iterate()
            costs.append(optimizer.error())
            path.append(_calibrations(optimizer.values(), start, hold))
    except RuntimeError as err:
        raise unsolvable(err) from err
    return _solution(
        problems, estimate_of(optimizer.values(), start, hold), hold, path, costs, dampings, _at_rest(costs, parameters)
    )


def _at_rest(costs: Sequence[float], parameters: gtsam.LevenbergMarquardtParams) -> bool:
    """Whether the last iteration gained next to nothing: GTSAM's own rule."""
    if len(costs) < 2:
        return False
    fall = costs[-2] - costs[-1]
    return fall <= max(parameters.getRelativeErrorTol() * costs[-2], parameters.getAbsoluteErrorTol())


def _calibrations(values: gtsam.Values, like: Estimate, hold: Sequence[str]) -> list[Calibration]:
    free = free_blocks(like, hold)
    return [extract_calibration(values, c, free, bag) for bag, c in enumerate(like.calibrations)]


def _solution(
    problems: Sequence[BagProblem],
    estimate: Estimate,
    hold: Sequence[str],
    path: Sequence[Sequence[Calibration]],
    costs: Sequence[float],
    dampings: Sequence[float],
    converged: bool,
) -> Solution:
    """The end of a path with its steps in the sigmas that hold there."""
    shared = SharedLayout.of(estimate.calibrations, len(problems))
    eliminated = eliminations_of(problems, estimate)
    H, _ = reduced_system(problems, eliminated, shared, estimate.calibrations)
    free = free_indices(shared, hold)
    sigmas = np.full(shared.size, np.inf)
    sigmas[free] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(H[np.ix_(free, free)], hermitian=True)), 1e-300))
    iterations = [
        Iteration(costs[i], costs[i + 1], dampings[i], _longest(before, after, shared, sigmas))
        for i, (before, after) in enumerate(pairwise(path))
    ]
    return Solution(estimate, total_cost(problems, estimate), shared, iterations, converged)


def _longest(before: Sequence[Calibration], after: Sequence[Calibration], shared: SharedLayout, sigmas: Array) -> float:
    """Largest change of a shared value in its sigmas."""
    largest = 0.0
    for bag, (one, other) in enumerate(zip(before, after, strict=True)):
        change = np.concatenate([one.local(other, block) for block in shared.places[bag]])
        largest = max(largest, float(np.max(np.abs(change) / sigmas[shared.indices(bag)], initial=0.0)))
    return largest
