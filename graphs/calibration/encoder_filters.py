# SPDX-License-Identifier: BSD-3-Clause
"""The filters of encoders: held until the noise is known, then found by how likely several of them are.

Readings of a filter hang on accelerations. While the process noise is loose these follow every sample, and the longest
filter, which asks for the least of them, costs least. Where the noise is small, friction that turns over has kinks
there that no iteration crosses. And at any noise the lowest cost favours long filters: the states they free follow the
noise of the readings. The likelihood of given filters, states integrated out, each with the noise that goes with it,
has none of these troubles: near its peak it is a parabola.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtrc

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.calibration.stages.solved_windows import anchored
from jointscope.graphs.calibration.stages.whole_stage import WholeStage
from jointscope.graphs.noise.unlikelihood import unlikelihood
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.lacking_effects import LackingEffect
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.model.robot import Robot

TRIED = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0]) * 1e-3  # [s] time constants of first order
ITERATIONS = 12  # of each trial
PARABOLAS = 3  # at the most
FAR = 4.0  # times the lowest cost, beyond which no longer filter is tried
SURELY = 5.0  # [sigma] from which a delay is one
LABEL = "encoder_filter@robot"
NEAR = 0.03  # relative change of a variance that changes nothing
NOISE_AGREES = 0.02  # relative difference of noise and residuals, so that likelihoods can be compared
ROUNDS = 3  # of a filter, and of the noise that is found with it


def free_filters(robot: Robot) -> tuple[str, ...]:
    """Full names of the variances that a calibration looks for."""
    names = [here.parameter(here.effect.variance) for here in robot.effects if isinstance(here.effect, SmoothedReading)]
    return tuple(name for name in names if not robot.parameters[name].fixed)


def with_filters(robot: Robot, values: dict[str, float], fixed: bool) -> Robot:
    """The robot with these variances, held or free."""
    own = {n: replace(robot.parameters[n], value=value, fixed=fixed) for n, value in values.items()}
    return replace(robot, parameters={**robot.parameters, **own})


def solved_with_filters(stage: WholeStage, held: Solved, names: tuple[str, ...]) -> Solved:
    """The solution with the likeliest filters, from the one with filters held.

    Sigmas are those with filters free; their values stay where they are likeliest, not where the cost is lowest.

    Args:
        stage: solves.
        held: where the robot's filters are held at their start.
        names: of their variances.
    """
    exact, found = replace(stage, agrees=NOISE_AGREES), held
    for _ in range(ROUNDS):
        before = _values(found, names)
        for name in names:
            trials = _NoisyTrials(exact, found, found.robot, name)
            found = trials.solved[trials.best()]
        if len(names) == 1 or all(abs(v - before[n]) < NEAR * before[n] for n, v in _values(found, names).items()):
            break
    robot = with_filters(found.robot, _values(found, names), fixed=False)
    problems, start = _carried(found, robot)
    noise = found.problems[0].dynamics.steps.noise
    here = stage.step("filters of encoders", problems, noise, start, 0)
    solution = replace(here, converged=True)
    return Solved.of([p.with_noise(noise) for p in problems], solution, stage.hold, found.sets)


def _values(solved: Solved, names: tuple[str, ...]) -> dict[str, float]:
    """Variances at which filters are held."""
    return {name: solved.robot.parameters[name].value for name in names}


def _carried(solved: Solved, robot: Robot) -> tuple[list[BagProblem], Estimate]:
    """The recordings on another robot, and the estimate for it."""
    estimate = solved.solution.estimate
    calibrations = tuple(c.carried_to(Calibration.of(robot)) for c in estimate.calibrations)
    problems = anchored([p.of_robot(robot) for p in solved.problems], calibrations)
    return problems, Estimate(estimate.states, calibrations)


def _settled(stage: WholeStage, solved: Solved, robot: Robot) -> Solved:
    """The solution of another robot from here."""
    problems, start = _carried(solved, robot)
    return stage.settled(problems, solved.problems[0].dynamics.steps.noise, start)


def lacking_filter(stage: WholeStage, solved: Solved) -> LackingEffect | None:
    """Filters of all encoders, where a delay was found and they are likelier than none, each with its own noise.

    A linear step does not tell: it freezes the moments at which joints turn over, and a filter moves them. Nor does the
    cost at the noise of the other model: a long filter frees the states to follow the noise of the readings.

    Args:
        stage: solves.
        solved: a solution without filters.
    """
    robot = solved.robot
    if not _is_late(robot, solved) or any(isinstance(here.effect, SmoothedReading) for here in robot.effects):
        return None
    effect, owner = LABEL.split("@")
    with_one = add_effect(robot, LABEL)
    (name,) = free_filters(with_one)
    trials = _Trials(stage, solved, with_filters(with_one, {name: float(TRIED[0]) ** 2}, True), name)
    best = trials.best()
    if not trials.is_between(best) or not trials.costs[best] < solved.solution.cost:
        return None
    filtered = _settled(replace(stage, agrees=NOISE_AGREES), solved, with_filters(with_one, {name: best}, True))
    fall = unlikelihood(solved.problems, solved.solution) - unlikelihood(filtered.problems, filtered.solution)
    if not fall > 0.0:
        return None
    calibration = filtered.solution.estimate.calibrations[0]
    values = calibration.by_name
    return LackingEffect(effect, owner, float(chdtrc(1.0, 2.0 * fall)), fall, values, tried=True)


def _is_late(robot: Robot, solved: Solved) -> bool:
    """Whether the calibration found a delay that is one."""
    names = solved.solution.estimate.calibrations[0].names
    sigmas = np.sqrt(np.diag(solved.covariance))
    found = dict(zip(names, solved.solution.estimate.calibrations[0].values.tolist(), strict=True))
    late = [i for i, n in enumerate(names) if n in robot.parameters and n.endswith(".delay")]
    return any(found[names[i]] > SURELY * sigmas[i] for i in late)


@dataclass
class _Trials:
    """Costs by the variance of one filter, all other values free, the noise as it is.

    Attributes:
        stage: solves.
        start: where to start, and the noise.
        robot: the model with all filters held.
        name: of the variance that is tried.
        costs: what is to be low, by variance.
        lowest: of the solutions' costs, by variance.
    """

    stage: WholeStage
    start: Solved
    robot: Robot
    name: str
    costs: dict[float, float] = field(default_factory=dict)
    lowest: dict[float, float] = field(default_factory=dict)

    def best(self) -> float:
        """The variance at which the cost is lowest."""
        for variance in sorted({*(TRIED**2).tolist(), self.robot.parameters[self.name].value}):
            self._try(variance)
            if self.lowest[variance] > FAR * min(self.lowest.values()):
                break
        for _ in range(PARABOLAS):
            best = min(self.costs, key=self.costs.__getitem__)
            between = _vertex(self.costs, best)
            if between is None or abs(between - best) < NEAR * best:
                break
            self._try(between)
        return min(self.costs, key=self.costs.__getitem__)

    def is_between(self, variance: float) -> bool:
        """Whether larger and smaller ones were tried and cost more."""
        return min(self.costs) < variance < max(self.costs)

    def _try(self, variance: float) -> None:
        try:
            self.costs[variance], self.lowest[variance] = self._cost(variance)
        except SolveError:
            self.costs[variance] = self.lowest[variance] = float("inf")

    def _cost(self, variance: float) -> tuple[float, float]:
        """What is to be low, and the lowest cost of a solution."""
        problems, start = _carried(self.start, with_filters(self.robot, {self.name: variance}, fixed=True))
        noise = self.start.problems[0].dynamics.steps.noise
        cost = self.stage.step("filters of encoders", problems, noise, start, ITERATIONS).cost
        return cost, cost


@dataclass
class _NoisyTrials(_Trials):
    """As `_Trials`, but how unlikely the readings are, each with the noise that goes with it.

    Attributes:
        solved: by variance.
    """

    solved: dict[float, Solved] = field(default_factory=dict)

    def _cost(self, variance: float) -> tuple[float, float]:
        near = min(self.solved, key=lambda v: abs(np.log(v / variance)), default=None)
        start = self.start if near is None else self.solved[near]
        robot = with_filters(self.robot, {self.name: variance}, fixed=True)
        solved = self.solved[variance] = _settled(self.stage, start, robot)
        return unlikelihood(solved.problems, solved.solution), solved.solution.cost


def _vertex(costs: dict[float, float], lowest: float) -> float | None:
    """Lowest point of the parabola through a value and its neighbours; None at an end."""
    values = sorted(costs)
    i = values.index(lowest)
    if not 0 < i < len(values) - 1:
        return None
    near = np.array(values[i - 1 : i + 2])
    a, b, _ = np.polyfit(near - lowest, [costs[value] for value in near.tolist()], 2)
    return float(lowest - b / (2.0 * a)) if np.isfinite(a) and a > 0.0 else None
