# SPDX-License-Identifier: BSD-3-Clause
"""The same problem as a plain GTSAM graph, one custom factor per sample, solved by GTSAM's Levenberg-Marquardt.

The slow, obvious way: GTSAM copies all values into Python for every callback, so an iteration is quadratic in the
number of samples. It is what the batch solver is held against on short recordings.
"""

from __future__ import annotations

from collections.abc import Sequence

import gtsam
import numpy as np

from jointscope.factors.custom_factor import custom_factor, extract_calibration, insert_calibration, state_key
from jointscope.factors.priors import shared_priors
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.errors import SolveError
from jointscope.robots.outside_modules import need_module


def nonlinear_graph(problems: Sequence[BagProblem], estimate: Estimate) -> gtsam.NonlinearFactorGraph:
    """All factors of all recordings, and the priors they share."""
    need_module("gtsam")
    graph = gtsam.NonlinearFactorGraph()
    like = estimate.calibrations[0]
    for bag, problem in enumerate(problems):
        for k in range(len(problem.dynamics)):
            graph.add(custom_factor(problem.dynamics, k, (k, k + 1), like, bag))
        for placed in problem.placed:
            for sample in range(len(placed.factor)):
                first = [int(placed.ticks[sample])] if placed.factor.states else []
                ticks = tuple(first[0] + i for i in range(placed.factor.states))
                graph.add(custom_factor(placed.factor, sample, ticks, like, bag))
    for prior in shared_priors(problems[0].robot):
        graph.add(custom_factor(prior, 0, (), like))
    return graph


def initial_values(estimate: Estimate) -> gtsam.Values:
    """States and shared values as GTSAM's values."""
    values = gtsam.Values()
    for bag, (x, calibration) in enumerate(zip(estimate.states, estimate.calibrations, strict=True)):
        for k, state in enumerate(x):
            values.insert(state_key(k, bag), state)
        insert_calibration(values, calibration, bag)
    return values


def estimate_of(values: gtsam.Values, like: Estimate) -> Estimate:
    """GTSAM's values as states and shared values."""
    states = tuple(
        np.array([values.atVector(state_key(k, bag)) for k in range(len(x))]) for bag, x in enumerate(like.states)
    )
    calibrations = tuple(extract_calibration(values, c, bag=bag) for bag, c in enumerate(like.calibrations))
    return Estimate(states, calibrations)


def solve_with_gtsam(
    problems: Sequence[BagProblem], start: Estimate, max_iterations: int = 50
) -> tuple[Estimate, float]:
    """Minimises with `gtsam.LevenbergMarquardtOptimizer`.

    Returns:
        The estimate and its cost (half the sum of squared whitened residuals).

    Raises:
        SolveError: a direction is not determined.
    """
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(max_iterations)
    parameters.setRelativeErrorTol(1e-10)
    parameters.setAbsoluteErrorTol(1e-10)
    parameters.setLinearSolverType("MULTIFRONTAL_QR")
    graph = nonlinear_graph(problems, start)
    try:
        optimizer = gtsam.LevenbergMarquardtOptimizer(graph, initial_values(start), parameters)
        values = optimizer.optimize()
    except RuntimeError as err:
        raise SolveError(f"GTSAM cannot solve the graph: {str(err).strip().splitlines()[0]}") from err
    return estimate_of(values, start), float(graph.error(values))
