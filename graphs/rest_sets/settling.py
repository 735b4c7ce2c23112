# SPDX-License-Identifier: BSD-3-Clause
"""Rests with the weights that they deserve: solved, weighed by what the residuals say, and solved again.

Bands have sharp edges, and a solver that begins far off sees none of them: the edges are blunt at first. How well link
encoders repeat is found from the residuals, never better than they say themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.rest_sets.rest_set import EDGE, RestSet
from jointscope.graphs.solving.batch_solver import Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import SetProblem

Array = NDArray[np.float64]
PASSES = 6  # of the repeatability
AGREES = 0.05  # relative change of it that asks for no further pass


@dataclass(frozen=True)
class Settled:
    """Rests that are solved.

    Attributes:
        rests: with the weights that the solution has.
        solution: of these.
        iterations: of all stages.
    """

    rests: RestSet
    solution: Solution
    iterations: int


def settled(
    rests: RestSet,
    estimate: Estimate,
    most_iterations: int,
    edges: Sequence[float] = (EDGE,),
    each: Callable[[int, RestSet, Solution], None] | None = None,
    beside: Sequence[SetProblem] = (),
) -> Settled:
    """Solves with edges that become sharp, until the repeatability agrees with the residuals.

    Args:
        rests: with the model and the weights to begin with.
        estimate: where to begin: the rests, then those beside.
        most_iterations: of each stage.
        edges: blur of the bands' edges, stage by stage.
        each: called with the number of each stage, its rests and its solution; may raise to end the search.
        beside: recordings of other kinds in the same graph.

    Raises:
        SolveError: the fit ran away.
    """
    iterations, stages = 0, (*edges, *[EDGE] * PASSES)
    for k, edge in enumerate(stages):
        rests = replace(rests, edge=edge)
        solution = solve([rests, *beside], estimate, max_iterations=most_iterations)
        estimate, iterations = solution.estimate, iterations + len(solution.iterations)
        if each is not None:
            each(k, rests, solution)
        scale = repeatability_of(rests, solution)
        agrees = edge == EDGE and np.all(np.abs(np.log(scale / rests.repeatability)) < AGREES)
        if agrees or k + 1 == len(stages):
            break
        rests = replace(rests, repeatability=scale)
    return Settled(rests, solution, iterations)


def repeatability_of(whole: RestSet, solution: Solution) -> Array:
    """Factor on the sigmas of the link encoders that the residuals ask for, at least 1, shape (n,)."""
    x, calibration = solution.estimate.states[0], solution.estimate.calibrations[0]
    size = np.sqrt(np.mean(whole.residuals(x, whole.model.named(calibration.values)) ** 2, axis=0))
    return np.maximum(whole.repeatability * size, 1.0)
