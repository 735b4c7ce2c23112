# SPDX-License-Identifier: BSD-3-Clause
"""A model fitted to some rests, and what it says of others: warm fits, since all models of a search are neighbours.

What is left out is judged by its cost with the values held: positions where links and motors stand are found there, the
likelihood of the friction band counts, and so does how well the fit says that encoders repeat, since a model that
explains little may not excuse itself by calling the encoders bad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.rest_sets.rest_set import EDGE, RestSet
from jointscope.graphs.rest_sets.settling import settled
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.whole_set import WholeSet
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.rests import Rests

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
MOST_ITERATIONS = 15  # of a stage of a fit that begins near its end
MOST_NEAR = 4  # of one that only lost some rests
FOLDS = 5
SMALLEST_FOLD = 2  # rests


@dataclass(frozen=True)
class RestFit:
    """A model fitted to rests.

    Attributes:
        rests: with the weights that go with the fit.
        x: states, shape (m, d).
        calibration: values.
        cost: with the price of these weights.
    """

    rests: RestSet
    x: Array
    calibration: Calibration
    cost: float

    @property
    def robot(self) -> Robot:
        """With the values found."""
        return self.rests.robot.with_values(self.values)

    @property
    def values(self) -> dict[str, float]:
        """Free values by full name."""
        return self.calibration.by_name

    def costs_of(self, others: RestSet, x: Array) -> Array:
        """Minus the log likelihood of each rest that was left out, the values held, but for a constant; shape (m,).

        Args:
            others: rests of the same robot.
            x: where to look for their states first, shape (m, d).
        """
        weighed = replace(others, robot=self.rests.robot, repeatability=self.rests.repeatability)
        costs = WholeSet(weighed, x, self.calibration, ()).system.costs
        return np.asarray(costs + price(weighed) / max(len(costs), 1))

    def without(self, left_out: Mask) -> RestFit:
        """Fitted to the other rests, with the same weights."""
        rests, x = self.rests.only(~left_out), self.x[~left_out]
        solution = solve([rests], Estimate((x,), (self.calibration,)), max_iterations=MOST_NEAR)
        return RestFit(rests, solution.estimate.states[0], solution.estimate.calibrations[0], solution.cost)


def fit_rests(rests: RestSet, x: Array, calibration: Calibration, edges: Sequence[float] = (EDGE,)) -> RestFit:
    """Fits values, states and the repeatability of the encoders.

    Args:
        rests: with the model and weights to begin with.
        x: states to begin with, shape (m, d).
        calibration: values to begin with.
        edges: blur of the bands' edges, stage by stage.

    Raises:
        SolveError: the fit ran away.
    """
    found = settled(rests, Estimate((x,), (calibration,)), MOST_ITERATIONS, edges)
    estimate, cost = found.solution.estimate, found.solution.cost + price(found.rests)
    return RestFit(found.rests, estimate.states[0], estimate.calibrations[0], cost)


def price(rests: RestSet) -> float:
    """What larger sigmas of the link encoders cost: the logarithms in a Gaussian likelihood."""
    return 0.0 if rests.rests.q_link is None else len(rests.rests) * float(np.sum(np.log(rests.repeatability)))


def folds_of(recordings: Sequence[Rests]) -> list[Mask]:
    """Groups of rests that are left out together, as masks over all of them.

    Each recording is cut into blocks that follow each other, whole weights or postures, and each group takes a block of
    every recording, since each may tell of another joint.
    """
    count = min(FOLDS, max(sum(map(len, recordings)) // SMALLEST_FOLD, 2))
    number = []
    for i, rests in enumerate(recordings):
        number += [((k * count) // len(rests) + i) % count for k in range(len(rests))]
    return [np.asarray(number) == fold for fold in range(count) if fold in number]
