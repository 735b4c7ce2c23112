# SPDX-License-Identifier: BSD-3-Clause
"""When the iterations of a batch solve may end.

Steps are measured in standard deviations that hold if the residuals have their stated size. Under a model that
contradicts the recording they are larger by a factor, the misfit, and so is the true uncertainty: steps shorter than a
part of that say nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.set_problem import Problem, motions

SLOW = 5.0  # [step tolerance] distance that may remain where steps shrink slowly, along directions nearly free
SMALL_FALL = 1e-3  # relative fall of the cost at which a short step has arrived
SURE, SHRINKS = 0.1, 0.5  # [short step], [step before] steps after which only states move
COST_TOLERANCE = 1e-10  # relative fall of the cost that is rounding
CONTRADICTS = 2.0  # [sigma] root mean square residual from which a model contradicts its recording
FLAT, FLAT_STEPS = 1e-5, 3  # relative fall of such a model's cost, so many times in a row, that ends the search
LAMBDA_START, LAMBDA_FACTOR = 1e-9, 30.0  # damping of a step that is as good as undamped; of the next that is tried
NEAR = 0.5  # [sigma] steps of a solution whose cost has kinks, as long as which it may end


@dataclass(frozen=True)
class Iteration:
    """What happened in one iteration: cost before and after, damping, largest step in sigmas."""

    cost_before: float
    cost_after: float
    damping: float
    step_in_sigmas: float

    @property
    def fall(self) -> float:
        """Relative fall of the cost."""
        return (self.cost_before - self.cost_after) / max(self.cost_before, 1e-300)


def measured_rows(problems: Sequence[Problem]) -> int:
    """Number of measured values in all recordings."""
    placed = [p.factor for problem in motions(problems) for p in problem.sensors]
    others = [problem.measured for problem in problems if not isinstance(problem, BagProblem)]
    return sum(len(factor) * len(factor.rows) for factor in placed) + sum(others)


def misfit(cost: float, measured: int) -> float:
    """Root mean square residual in sigmas, at least 1."""
    return float(max(2.0 * cost / max(measured, 1), 1.0) ** 0.5)


def short_step(cost: float, tolerance: float, measured: int) -> float:
    """Length [sigma] below which a step says nothing, where the tolerance holds for residuals of the stated size."""
    return tolerance * misfit(cost, measured)


def has_converged(
    iterations: Sequence[Iteration], tolerance: float, measured: int, undamped: bool, smooth: bool = False
) -> bool:
    """Whether the last step was short enough and the next ones will be shorter.

    Args:
        iterations: so far, at least one.
        tolerance: step [sigma] that is short enough.
        measured: number of measured values.
        undamped: whether the last step was an undamped one.
        smooth: whether no step was rejected: the cost has no kinks here, and steps shrink quadratically.
    """
    last = iterations[-1]
    enough = short_step(last.cost_after, tolerance, measured)
    arrived = last.step_in_sigmas < enough and _remaining(iterations) < SLOW * enough
    done = last.fall < SMALL_FALL or (smooth and _only_states_move(iterations, enough))
    return (arrived and done) or (last.fall < COST_TOLERANCE and undamped)


def is_flat(iterations: Sequence[Iteration], measured: int) -> bool:
    """Whether a model that contradicts its recording gains nothing any more, although its values still move.

    The contradiction may hide in a large process noise. It shows where kinks of a friction that fits nowhere let only
    short, damped steps lower the cost.
    """
    last = iterations[-FLAT_STEPS:]
    contradicts = misfit(last[-1].cost_after, measured) > CONTRADICTS
    kinked = all(i.damping > LAMBDA_START and i.step_in_sigmas < NEAR for i in last)
    return (contradicts or kinked) and len(last) == FLAT_STEPS and all(i.fall < FLAT for i in last)


def is_crawling(iterations: Sequence[Iteration], measured: int) -> bool:
    """Whether such a model still gains, but so little that more iterations would not settle it."""
    last = iterations[-1]
    return misfit(last.cost_after, measured) > CONTRADICTS and last.fall < SMALL_FALL


def next_damping(iterations: Sequence[Iteration]) -> float:
    """The one to begin with where another solve goes on from these."""
    return max(iterations[-1].damping / LAMBDA_FACTOR, LAMBDA_START) if iterations else LAMBDA_START


def _remaining(iterations: Sequence[Iteration]) -> float:
    """How far the minimum may still be, in sigmas, if the steps go on shrinking as the last one did."""
    last = iterations[-1].step_in_sigmas
    if len(iterations) < 2:
        return last
    ratio = min(last / max(iterations[-2].step_in_sigmas, 1e-300), 0.97)
    return last * ratio / (1.0 - ratio)


def _only_states_move(iterations: Sequence[Iteration], enough: float) -> bool:
    """Whether the last step moved the shared values by next to nothing, and the cost will fall by as little."""
    if len(iterations) < 2:
        return False
    before, last = iterations[-2:]
    falls = last.fall * last.fall / max(before.fall, 1e-300)  # the next one, if they go on shrinking like that
    return falls < SMALL_FALL and 0.0 < last.step_in_sigmas < min(SURE * enough, SHRINKS * before.step_in_sigmas)
