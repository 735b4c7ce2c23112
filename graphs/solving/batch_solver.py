# SPDX-License-Identifier: BSD-3-Clause
"""Levenberg-Marquardt over the condensed GTSAM graph of all recordings.

It minimises the same cost as the GTSAM graph of reference_graph.py, which has a factor for every sample; a test shows
that both end in the same point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import Elimination, eliminations_of
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.convergence import (
    LAMBDA_FACTOR,
    LAMBDA_START,
    Iteration,
    has_converged,
    is_crawling,
    is_flat,
    measured_rows,
    short_step,
)
from jointscope.graphs.solving.damped_step import LARGEST, damped_step, damping_of_states, shared_step
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import Problem, cost_of, priors_of
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.state_damping import StateDamping
from jointscope.graphs.solving.stretch import Elsewhere
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]
First = Callable[[CondensedGraph, gtsam.Values], gtsam.Values | None]

SMALLEST = 1e-12  # damping that is as good as none
STEP_TOLERANCE = 0.1  # [sigma] a shared value whose last step was smaller has arrived: the next is far smaller still


@dataclass
class Solution:
    """Result of a batch solve.

    Attributes:
        estimate: the minimum.
        cost: half the sum of squared whitened residuals.
        shared: layout of the shared values.
        iterations: history.
        converged: False if the iterations ended before the step became small.
        flat: the iterations ended because a model that contradicts its recording gained nothing any more.
    """

    estimate: Estimate
    cost: float
    shared: SharedLayout
    iterations: list[Iteration] = field(default_factory=list)
    converged: bool = False
    flat: bool = False


class Solver(Protocol):
    """Minimises the cost of some recordings: `solve`, or what takes its place for all samples."""

    def __call__(
        self,
        problems: Sequence[Problem],
        start: Estimate,
        *,
        max_iterations: int,
        hold: Sequence[str],
        progress: Progress | None,
    ) -> Solution:
        """Arguments and result as of `solve`."""


def solve(
    problems: Sequence[Problem],
    start: Estimate,
    *,
    max_iterations: int = 30,
    step_tolerance: float = STEP_TOLERANCE,
    hold: Sequence[str] = (),
    progress: Progress | None = None,
    first: First | None = None,
    length: int = 0,
    damping: float = LAMBDA_START,
    elsewhere: Elsewhere | None = None,
) -> Solution:
    """Minimises the cost of all recordings together.

    Args:
        problems: factors of each recording, all of one robot.
        start: where to begin.
        max_iterations: linearizations at the most; the solution says whether it converged.
        step_tolerance: largest step of a shared value, in its sigmas times the misfit, at which it has converged.
        hold: blocks that stay at their start, for example "dynamics".
        progress: called with a text and the share done.
        first: finds values to go on from; where it finds none, or they cost more than the start, the start is taken.
        length: steps in one condensed factor; chosen by the number of samples if 0.
        damping: the first one that is tried.
        elsewhere: keeps the recordings of motion, which stand first, if not this process; goes without `first`.

    Raises:
        SolveError: the cost is not finite or cannot be lowered from a point that is no minimum.
    """
    graph, values = CondensedGraph.of(problems, start, hold, length, elsewhere)
    if first is not None:
        begin, found = graph.cost(values), first(graph, values)
        if found is not None and graph.cost(found) <= begin:
            values = found
        else:  # the states inside stretches have gone astray, too
            graph, values = CondensedGraph.of(problems, start, hold, length)
    ticks = [
        problem.timeline.ticks if isinstance(problem, BagProblem) else np.arange(float(len(x)))
        for problem, x in zip(problems, start.states, strict=True)
    ]
    cost, bends = graph.cost(values), StateDamping.of(ticks)
    descent = _Descent(graph, values, cost, graph.costs, bends)
    if not np.isfinite(descent.cost):
        raise SolveError("the cost at the start is not finite; check start values and recording")
    descent.run(max_iterations, step_tolerance, measured_rows(problems), progress, damping)
    graph.cost(descent.values)  # the stretches remember the point where they were evaluated last
    estimate = graph.estimate(descent.values)
    end = (descent.iterations, descent.converged, descent.flat)
    return Solution(estimate, descent.cost, graph.shared, *end)


@dataclass
class _Descent:
    """The iterations of one solve; as in `Solution`, `costs` by tick, their damping, whether a step was rejected."""

    graph: CondensedGraph
    values: gtsam.Values
    cost: float
    costs: list[Array]
    bends: StateDamping
    iterations: list[Iteration] = field(default_factory=list)
    converged: bool = False
    flat: bool = False
    rejected: bool = False

    def run(self, most: int, tolerance: float, measured: int, progress: Progress | None, damping: float) -> None:
        """Iterates until the step is short, nothing is gained, or `most` linearizations were made."""
        for i in range(most):
            if progress:
                progress(f"iteration {i + 1}, cost {self.cost:.6g}", i / most)
            accepted = self._lowered(damping, tolerance, measured)
            if accepted is None:
                return
            undamped, smooth = accepted <= LAMBDA_START, not self.rejected
            self.converged = has_converged(self.iterations, tolerance, measured, undamped, smooth)
            self.flat = not self.converged and is_flat(self.iterations, measured)
            if self.converged or self.flat:
                return
            damping = _next(accepted)
            self.bends.relaxed()
        self.flat = bool(self.iterations) and is_crawling(self.iterations, measured)

    def _lowered(self, damping: float, tolerance: float, measured: int) -> float | None:
        """Takes a step that lowers the cost; returns its damping, or None where the minimum is reached."""
        while True:
            step = damped_step(self.graph, self.values, damping, self.bends.values)
            self.graph.expect(damping_of_states(_next(damping)), self.bends.later)
            cost, costs = self.graph.cost(step.values), self.graph.costs
            if np.isfinite(cost) and cost <= self.cost * (1.0 + 1e-12):
                self.iterations.append(Iteration(self.cost, cost, damping, step.in_sigmas))
                self.values, self.cost, self.costs = step.values, cost, costs
                return damping
            self.rejected = True
            if self.bends.raised(self.costs, costs):
                continue
            # a start says nothing yet about how well the model can fit
            short = short_step(self.cost, tolerance, measured) if self.iterations else tolerance
            if 0.0 < step.in_sigmas < short and damping <= LAMBDA_START:
                # there already: only states at a kink of the friction keep the cost from falling
                self.converged = True
                return None
            damping *= LAMBDA_FACTOR
            if damping > LARGEST:
                self._end_stuck(step.in_sigmas, tolerance)
                return None

    def _end_stuck(self, in_sigmas: float, tolerance: float) -> None:
        """No damping lowers the cost: a minimum within rounding, or an error."""
        if in_sigmas >= max(tolerance, 0.1):
            raise SolveError(
                f"the cost {self.cost:.6g} cannot be lowered any further although the next step is "
                f"{in_sigmas:.2g} sigma; the model contradicts the recording or a start value is far off"
            )
        self.converged = True


def _next(damping: float) -> float:
    """Damping after a step that was accepted."""
    return max(damping / LAMBDA_FACTOR, SMALLEST)


@dataclass(frozen=True)
class NewtonStep:
    """A Gauss-Newton step.

    Attributes:
        estimate: where it leads.
        in_sigmas: largest change of a shared value in sigmas.
        dx: change of the states of each recording.
        dp: change of the shared values, shape (s,).
    """

    estimate: Estimate
    in_sigmas: float
    dx: list[Array]
    dp: Array


def newton_step(
    problems: Sequence[Problem],
    solution: Solution,
    hold: Sequence[str] = (),
    eliminations: Sequence[Elimination] | None = None,
) -> NewtonStep:
    """One step from a solution, not checked against the cost.

    Args:
        problems: factors of each recording.
        solution: where it begins.
        hold: blocks that stay.
        eliminations: at the solution, where they are there already.
    """
    shared, estimate = solution.shared, solution.estimate
    free = free_indices(shared, hold)
    if eliminations is None:
        eliminations = eliminations_of(problems, estimate)
    H, g = reduced_system(problems, eliminations, shared, solution.estimate.calibrations)
    dp, in_sigmas = shared_step(H, g, free, 0.0, shared, solution.estimate.calibrations[0])
    dx = [e.states(dp[shared.indices(b)]) for b, e in enumerate(eliminations)]
    return NewtonStep(solution.estimate.moved(dx, dp, shared), in_sigmas, dx, dp)


def first_step(problems: Sequence[Problem], estimate: Estimate, hold: Sequence[str] = ()) -> Estimate | None:
    """Where one hardly damped step leads; None where the cost does not fall."""
    graph, values = CondensedGraph.of(problems, estimate, hold)
    begin, step = graph.cost(values), damped_step(graph, values, LAMBDA_START)
    return graph.estimate(step.values) if graph.cost(step.values) < begin else None


def total_cost(problems: Sequence[Problem], estimate: Estimate) -> float:
    """Cost of all recordings and of the priors they share."""
    bags = zip(problems, estimate.states, estimate.calibrations, strict=True)
    return sum(cost_of(*bag) for bag in bags) + prior_cost(problems, estimate.calibrations)


def prior_cost(problems: Sequence[Problem], calibrations: Sequence[Calibration]) -> float:
    """Cost of what recordings share."""
    residuals = ((p.residual((), calibrations[i]) / p.sigmas) for p, i in priors_of(problems, calibrations))
    return 0.5 * sum(float(np.sum(r**2)) for r in residuals)


def reduced_system(
    problems: Sequence[Problem],
    eliminations: Sequence[Elimination],
    shared: SharedLayout,
    calibrations: Sequence[Calibration],
    without: Sequence[str] = (),
) -> tuple[Array, Array]:
    """Hessian and gradient on the shared values, states eliminated, priors added but those `without` some blocks."""
    H, g = np.zeros((shared.size, shared.size)), np.zeros(shared.size)
    for bag, elimination in enumerate(eliminations):
        index = shared.indices(bag)
        H[np.ix_(index, index)] += elimination.S
        g[index] += elimination.s
    for prior, piece in priors_of(problems, calibrations):
        linear = prior.linearize((), calibrations[piece])
        for block, J in linear.by_block.items():
            if block in without:
                continue
            columns = shared.places[piece][block]
            J = J[0] / prior.sigmas[:, None]
            H[columns, columns] += J.T @ J
            g[columns] += J.T @ (linear.residual[0] / prior.sigmas)
    return H, g


def free_indices(shared: SharedLayout, hold: Sequence[str]) -> NDArray[np.intp]:
    """Indices of the shared values that may change."""
    held = np.zeros(shared.size, dtype=bool)
    for places in shared.places:
        for block in hold:
            if block in places:
                held[places[block]] = True
    return np.flatnonzero(~held)
