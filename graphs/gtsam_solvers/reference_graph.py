# SPDX-License-Identifier: BSD-3-Clause
"""The same problem as a plain GTSAM graph, one custom factor per sample, solved by GTSAM's Levenberg-Marquardt.

The slow, obvious way: GTSAM copies all values into Python for every callback, so an iteration is quadratic in the
number of samples. It is what the condensed graph is held against on short recordings.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import gtsam
import numpy as np

from jointscope.factors.priors import shared_priors
from jointscope.factors.single import extract_calibration, insert_calibration, single_factor, state_key
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.errors import SolveError
from jointscope.robots.outside_modules import need_module


def free_blocks(estimate: Estimate, hold: Sequence[str] = ()) -> tuple[str, ...]:
    """Blocks of shared values that are variables: those that are not held, and not empty."""
    return estimate.calibrations[0].free(hold)


def nonlinear_graph(
    problems: Sequence[BagProblem], estimate: Estimate, hold: Sequence[str] = ()
) -> gtsam.NonlinearFactorGraph:
    """All factors of whole recordings, and the priors they share; blocks that are held are no variables."""
    need_module("gtsam")
    graph, free = gtsam.NonlinearFactorGraph(), free_blocks(estimate, hold)
    for bag, (problem, like) in enumerate(zip(problems, estimate.calibrations, strict=True)):
        for k in range(len(problem.dynamics)):
            graph.add(single_factor(problem.dynamics, k, (k, k + 1), like, bag, free))
        for placed in problem.placed:
            if not placed.factor.states and not set(placed.factor.blocks) & set(free):
                continue
            for sample in range(len(placed.factor)):
                first = [int(placed.ticks[sample])] if placed.factor.states else []
                ticks = tuple(first[0] + i for i in range(placed.factor.states))
                graph.add(single_factor(placed.factor, sample, ticks, like, bag, free))
    for prior in shared_priors(problems[0].robot):
        if set(prior.blocks) & set(free):
            graph.add(single_factor(prior, 0, (), estimate.calibrations[0], 0, free))
    return graph


def initial_values(estimate: Estimate, hold: Sequence[str] = ()) -> gtsam.Values:
    """States and shared values as GTSAM's values."""
    values, free = gtsam.Values(), free_blocks(estimate, hold)
    for bag, (x, calibration) in enumerate(zip(estimate.states, estimate.calibrations, strict=True)):
        for k, state in enumerate(x):
            values.insert(state_key(k, bag), state)
        insert_calibration(values, calibration, bag, free)
    return values


def estimate_of(values: gtsam.Values, like: Estimate, hold: Sequence[str] = ()) -> Estimate:
    """GTSAM's values as states and shared values."""
    states = tuple(
        np.array([values.atVector(state_key(k, bag)) for k in range(len(x))]) for bag, x in enumerate(like.states)
    )
    free = free_blocks(like, hold)
    calibrations = tuple(extract_calibration(values, c, free, bag) for bag, c in enumerate(like.calibrations))
    return Estimate(states, calibrations)


def marquardt_parameters() -> gtsam.LevenbergMarquardtParams:
    """Settings of GTSAM's optimizer: its own damping, and an end where next to nothing is gained.

    The damping is the same for all variables. One relative to the diagonal of the Hessian would hold states fast: steps
    of the dynamics know each of them a million times better from its neighbours than the sensors know the motion.
    """
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(1e-10)
    parameters.setAbsoluteErrorTol(1e-8)
    return parameters


def unsolvable(err: Exception, names: Mapping[int, str] | None = None) -> SolveError:
    """What GTSAM says where a graph has no solution, in one line.

    Args:
        err: raised by GTSAM, or by a factor of the user.
        names: of variables, by key.
    """
    text = " ".join(str(err).split())
    if found := re.search(r"near variable (\d+) \(Symbol: (\w+)\)", text):
        name = (names or {}).get(int(found[1]), found[2])
        return SolveError(
            f"GTSAM cannot solve the graph: nothing determines {name} ({found[2]}) where it was eliminated; add a "
            f"factor on it, or correct the one that should tell it (GTSAM: {text[:60]})"
        )
    return SolveError(f"GTSAM cannot solve the graph: {text[:200]}")
