# SPDX-License-Identifier: BSD-3-Clause
"""Levenberg-Marquardt over all samples of all recordings, linearised in batches.

It minimises the same cost as the GTSAM graph of reference_graph.py; a test shows that both end in the same point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor
from jointscope.factors.priors import DynamicsPrior, RotationPrior
from jointscope.graphs.bag_problem import BagProblem
from jointscope.graphs.banded_solver import Elimination, eliminate
from jointscope.graphs.convergence import Iteration, has_converged, is_crawling, is_flat, measured_rows, short_step
from jointscope.graphs.normal_equations import NormalEquations, build, cost
from jointscope.graphs.shared_layout import SharedLayout
from jointscope.graphs.state_damping import StateDamping
from jointscope.graphs.undetermined import undetermined
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

LAMBDA_START = 1e-9
LAMBDA_FACTOR = 30.0
LAMBDA_LARGEST = 1e8
LAMBDA_STATES = 1e-9  # of the states, as long as shorter steps of the shared values may help
STEP_TOLERANCE = 0.1  # [sigma] a shared value whose last step was smaller has arrived: the next is far smaller still


@dataclass(frozen=True)
class Estimate:
    """States and shared values of all recordings.

    Attributes:
        states: states of each recording, shape (m + 1, 4n).
        calibrations: shared values with the biases of each recording.
    """

    states: tuple[Array, ...]
    calibrations: tuple[Calibration, ...]

    def moved(self, dx: Sequence[Array], dp: Array, shared: SharedLayout) -> Estimate:
        """The estimate after a step."""
        return Estimate(
            tuple(x + d for x, d in zip(self.states, dx, strict=True)),
            tuple(c.retract(shared.step(dp, i)) for i, c in enumerate(self.calibrations)),
        )


@dataclass
class Solution:
    """Result of a batch solve.

    Attributes:
        estimate: the minimum.
        cost: half the sum of squared whitened residuals.
        iterations: history.
        hessian: Hessian on the shared values with all states eliminated, where the last step began, shape (s, s).
        shared: layout of the shared values.
        systems: normal equations of each recording at the estimate.
        converged: False if the iterations ended before the step became small.
        flat: the iterations ended because a model that contradicts its recording gained nothing any more.
    """

    estimate: Estimate
    cost: float
    hessian: Array
    shared: SharedLayout
    systems: list[NormalEquations]
    iterations: list[Iteration] = field(default_factory=list)
    converged: bool = False
    flat: bool = False


def priors_of(problem: BagProblem) -> list[Factor]:
    """The priors that all recordings share: dynamics and rotations."""
    robot = problem.robot
    return [DynamicsPrior.of(robot), *(RotationPrior(gyro) for gyro in robot.gyros)]


def solve(
    problems: Sequence[BagProblem],
    start: Estimate,
    *,
    max_iterations: int = 30,
    step_tolerance: float = STEP_TOLERANCE,
    hold: Sequence[str] = (),
    progress: Progress | None = None,
) -> Solution:
    """Minimises the cost of all recordings together.

    Args:
        problems: factors of each recording, all of one robot.
        start: where to begin.
        max_iterations: linearizations at the most; the solution says whether it converged.
        step_tolerance: largest step of a shared value, in its sigmas times the misfit, at which it has converged.
        hold: blocks that stay at their start, for example "dynamics".
        progress: called with a text and the share done.

    Raises:
        SolveError: the cost is not finite or cannot be lowered from a point that is no minimum.
    """
    shared = SharedLayout.of(start.calibrations[0], BagProblem.owners(problems))
    systems = _build(problems, start)
    solution = Solution(start, _cost(problems[0], systems, start), np.zeros((0, 0)), shared, systems)
    if not np.isfinite(solution.cost):
        raise SolveError("the cost at the start is not finite; check start values and recording")
    damping, measured = LAMBDA_START, measured_rows(problems)
    bends = StateDamping.of([problem.timeline.ticks for problem in problems])
    for i in range(max_iterations):
        if progress:
            progress(f"iteration {i + 1}, cost {solution.cost:.6g}", i / max_iterations)
        step = _try(problems, solution, hold, damping, bends)
        while not step.accepted:
            if not bends.raised([s.costs for s in solution.systems], [s.costs for s in step.systems]):
                if damping <= LAMBDA_START and 0.0 < step.in_sigmas < short_step(
                    solution.cost, step_tolerance, measured
                ):
                    # there already: only states at a kink of the friction keep the cost from falling
                    solution.converged = True
                    return solution
                damping *= LAMBDA_FACTOR
            if damping > LAMBDA_LARGEST:
                return _stuck(solution, step, step_tolerance)
            step = _try(problems, solution, hold, damping, bends)
        solution.iterations.append(Iteration(solution.cost, step.cost, damping, step.in_sigmas))
        solution.estimate, solution.cost, solution.systems = step.estimate, step.cost, step.systems
        solution.converged = has_converged(solution.iterations, step_tolerance, measured, damping <= LAMBDA_START)
        solution.flat = not solution.converged and is_flat(solution.iterations, measured)
        if solution.converged or solution.flat:
            break
        damping = max(damping / LAMBDA_FACTOR, 1e-12)
        bends.relaxed()
    else:
        solution.flat = bool(solution.iterations) and is_crawling(solution.iterations, measured)
    return solution


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


@dataclass(frozen=True)
class _Trial(NewtonStep):
    """A step whose end was linearised: normal equations, cost, and whether the cost falls."""

    systems: list[NormalEquations]
    cost: float
    accepted: bool


def newton_step(
    problems: Sequence[BagProblem],
    solution: Solution,
    hold: Sequence[str] = (),
    damping: float = 0.0,
    bends: StateDamping | None = None,
) -> NewtonStep:
    """One step from the solution's normal equations, not checked against the cost.

    Args:
        problems: factors of each recording.
        solution: estimate with its normal equations; receives the Hessian.
        hold: blocks that stay.
        damping: Levenberg-Marquardt lambda, relative to the diagonal.
        bends: further damping of some states.
    """
    shared = solution.shared
    free = free_indices(shared, hold)
    of_states = _of_states(damping)
    local = bends.values if bends else [np.zeros(1) for _ in problems]
    eliminations = [eliminate(s, np.maximum(of_states, own)) for s, own in zip(solution.systems, local, strict=True)]
    H, g = reduced_system(problems[0], solution.systems, eliminations, shared, solution.estimate.calibrations[0])
    try:
        dp, in_sigmas = _solve_shared(H, g, free, damping)
    except np.linalg.LinAlgError as err:
        raise undetermined(H, free, shared, solution.estimate.calibrations[0]) from err
    dx = [e.states(dp[shared.indices(b)]) for b, e in enumerate(eliminations)]
    solution.hessian = H
    return NewtonStep(solution.estimate.moved(dx, dp, shared), in_sigmas, dx, dp)


def _of_states(damping: float) -> float:
    """Damping of the states: they follow the shared values at once, or a long valley is walked in tiny steps.

    Where steps of the shared values are next to nothing and the cost still rises, the states are what is too far off.
    """
    return float(max(min(damping, LAMBDA_STATES), (damping / LAMBDA_LARGEST) ** 1.5))


def first_step(problems: Sequence[BagProblem], estimate: Estimate, hold: Sequence[str] = ()) -> Estimate:
    """Where one hardly damped step leads; for starts from which every step is an improvement."""
    shared = SharedLayout.of(estimate.calibrations[0], BagProblem.owners(problems))
    here = Solution(estimate, float("nan"), np.zeros((0, 0)), shared, _build(problems, estimate))
    return newton_step(problems, here, hold, LAMBDA_START).estimate


def _try(
    problems: Sequence[BagProblem], solution: Solution, hold: Sequence[str], damping: float, bends: StateDamping
) -> _Trial:
    """One damped step. The trial point is linearised at once: nearly every step is accepted."""
    step = newton_step(problems, solution, hold, damping, bends)
    systems = _build(problems, step.estimate)
    cost_there = _cost(problems[0], systems, step.estimate)
    accepted = bool(np.isfinite(cost_there) and cost_there <= solution.cost * (1.0 + 1e-12))
    return _Trial(step.estimate, step.in_sigmas, step.dx, step.dp, systems, cost_there, accepted)


def _stuck(solution: Solution, step: _Trial, step_tolerance: float) -> Solution:
    """No damping lowers the cost: a minimum within rounding, or an error."""
    if step.in_sigmas >= max(step_tolerance, 0.1):
        raise SolveError(
            f"the cost {solution.cost:.6g} cannot be lowered any further although the next step is "
            f"{step.in_sigmas:.2g} sigma; the model contradicts the recording or a start value is far off"
        )
    solution.converged = True
    return solution


def _build(problems: Sequence[BagProblem], estimate: Estimate) -> list[NormalEquations]:
    bags = zip(problems, estimate.states, estimate.calibrations, strict=True)
    return [build(problem, x, calibration) for problem, x, calibration in bags]


def _cost(problem: BagProblem, systems: Sequence[NormalEquations], estimate: Estimate) -> float:
    return sum(system.cost for system in systems) + _prior_cost(problem, estimate.calibrations[0])


def _prior_cost(problem: BagProblem, calibration: Calibration) -> float:
    residuals = [prior.residual((), calibration) / prior.sigmas for prior in priors_of(problem)]
    return 0.5 * sum(float(np.sum(r**2)) for r in residuals)


def total_cost(problems: Sequence[BagProblem], estimate: Estimate) -> float:
    """Cost of all recordings and of the priors they share."""
    bags = zip(problems, estimate.states, estimate.calibrations, strict=True)
    total = sum(cost(problem, x, calibration) for problem, x, calibration in bags)
    return total + _prior_cost(problems[0], estimate.calibrations[0])


def reduced_system(
    problem: BagProblem,
    systems: Sequence[NormalEquations],
    eliminations: Sequence[Elimination],
    shared: SharedLayout,
    calibration: Calibration,
) -> tuple[Array, Array]:
    """Hessian and gradient on the shared values of all recordings, states eliminated, priors added."""
    H, g = np.zeros((shared.size, shared.size)), np.zeros(shared.size)
    for bag, elimination in enumerate(eliminations):
        index = shared.indices(bag)
        H[np.ix_(index, index)] += elimination.S
        g[index] += elimination.s
    for prior in priors_of(problem):
        linear = prior.linearize((), calibration)
        for block, J in linear.by_block.items():
            columns = shared.columns[block]
            J = J[0] / prior.sigmas[:, None]
            H[columns, columns] += J.T @ J
            g[columns] += J.T @ (linear.residual[0] / prior.sigmas)
    return H, g


def free_indices(shared: SharedLayout, hold: Sequence[str]) -> NDArray[np.intp]:
    """Indices of the shared values that may change."""
    held = np.zeros(shared.size, dtype=bool)
    for bag in range(len(shared.owners)):
        for block in hold:
            held[shared.indices(bag)[shared.columns[block]]] = True
    return np.flatnonzero(~held)


def _solve_shared(H: Array, g: Array, free: NDArray[np.intp], damping: float) -> tuple[Array, float]:
    """Damped step of the shared values, and the largest undamped one in sigmas."""
    dp = np.zeros(len(g))
    if len(free) == 0:
        return dp, 0.0
    block = H[np.ix_(free, free)]
    if not (np.all(np.isfinite(block)) and np.all(np.isfinite(g))):
        raise SolveError("the estimate ran away: a Hessian is not finite; the model contradicts the recording")
    factor = cho_factor(block + damping * np.diag(np.diag(block)))
    dp[free] = -cho_solve(factor, g[free])
    # Newton decrement per value: step over its conditional-free sigma
    sigma = np.sqrt(np.maximum(np.diag(cho_solve(factor, np.eye(len(free)))), 0.0))
    return dp, float(np.max(np.abs(dp[free]) / sigma))
