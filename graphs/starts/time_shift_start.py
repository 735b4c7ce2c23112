# SPDX-License-Identifier: BSD-3-Clause
"""Start values of delays, clock offsets and places of trackers: the ones at which the states fit best.

A sample stands between two states near the instant at which the present delay puts it. From a delay that is off by
several samples the iterations run into a valley of bent states and never come out of it. A tracker that stands
decimetres from where the file says bends them even more than a delay does, so it is placed first, and once more after.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import chunks, states_of
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

TRIED = np.array([1.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0, 21.0, 24.0]) * 1e-3  # [s], and their negatives
OF_TARGETS = np.array([30.0, 40.0, 50.0, 60.0, 75.0, 90.0, 110.0, 130.0, 150.0]) * 1e-3  # [s] cameras are later
ITERATIONS = 3
REFINED = 5  # parabolas through the lowest values at the most
NEAR = 2e-4  # [s]
PLACED = 6  # Gauss-Newton steps that place a tracker


def with_best_shifts(
    problems: Sequence[BagProblem], start: Estimate, hold: Sequence[str] = ()
) -> tuple[list[BagProblem], Estimate]:
    """Problems and estimate with every free delay and offset where the states fit best, one after the other.

    Args:
        problems: factors of each recording, or of windows of them.
        start: where to begin.
        hold: further blocks that stay.
    """
    best = list(problems)
    if DYNAMICS in hold:
        return best, start
    estimate = with_placed_trackers(problems, start)
    for name in _shifts(problems[0].robot):
        scan = _Scan(best, estimate, name, (DYNAMICS, *hold))
        value = scan.lowest()
        best, estimate = placed(best, {name: value}), _with_value(estimate, name, value)
        estimate = with_placed_trackers(best, estimate)
    return best, estimate


def with_placed_trackers(problems: Sequence[BagProblem], estimate: Estimate) -> Estimate:
    """The estimate with position targets and their trackers where the states see them, as far as they are free.

    States stay. Their springs are not yet right and bend them by millimetres; nobody knows a tracker that well.

    Args:
        problems: factors of each recording, or of windows of them.
        estimate: states and values.
    """
    robot, calibration = problems[0].robot, estimate.calibrations[0]
    targets, names = {target.name for target in robot.targets}, calibration.names
    shifts = _shifts(robot)
    there = [name.split(".", 1)[0] in targets and name not in shifts for name in names]
    own = [i for i, its in enumerate(there) if its and not calibration.positive[i]]
    if not own:
        return estimate
    prior = np.array([robot.parameters[names[i]].prior_sigma for i in own])
    mean = np.array([robot.parameters[names[i]].value for i in own])
    for _ in range(PLACED):
        H, g = np.diag(prior**-2.0), (mean - calibration.dynamics[own]) / prior**2
        for problem, x, bag in zip(problems, estimate.states, estimate.calibrations, strict=True):
            here = bag.with_points({DYNAMICS: calibration.dynamics})
            for factor, ticks in (piece for part in problem.placed for piece in chunks(part)):
                if factor.name in targets:
                    linear = factor.linearize(states_of(factor, ticks, x), here)
                    sigmas = np.broadcast_to(factor.sigmas, linear.residual.shape)
                    J = (linear.by_block[DYNAMICS][:, :, own] / sigmas[:, :, None]).reshape(-1, len(own))
                    H, g = H + J.T @ J, g - J.T @ (linear.residual / sigmas).reshape(-1)
        dynamics = calibration.dynamics.copy()
        dynamics[own] += np.linalg.solve(H, g)
        calibration = calibration.with_points({DYNAMICS: dynamics})
    bags = tuple(bag.with_points({DYNAMICS: calibration.dynamics}) for bag in estimate.calibrations)
    return Estimate(estimate.states, bags)


@dataclass
class _Scan:
    """Cost of the states by the value of one shift; parameters are held, mountings and biases follow."""

    problems: Sequence[BagProblem]
    estimate: Estimate
    name: str
    hold: tuple[str, ...]
    costs: dict[float, float] = field(default_factory=dict)

    def lowest(self) -> float:
        """The value at which the states fit best."""
        robot = self.problems[0].robot
        parameter = robot.parameters[self.name]
        one_sided = parameter.positive or _one_sided(robot, self.name)
        # all of them: far from the right one the cost has further valleys
        later = OF_TARGETS if any(self.name.startswith(f"{target.name}.") for target in robot.targets) else ()
        tried = np.array([*TRIED, *later])
        for value in (parameter.value, *tried, *(() if one_sided else -tried)):
            self._cost(float(value))
        for _ in range(REFINED):
            best = self._best()
            between = self._vertex(best)
            if between is None or abs(between - best) < NEAR:
                break
            self._cost(between)
        return self._best()

    def _best(self) -> float:
        return min(self.costs, key=self.costs.__getitem__)

    def _cost(self, value: float) -> float:
        if value not in self.costs:
            trial, moved = placed(self.problems, {self.name: value}), _with_value(self.estimate, self.name, value)
            try:
                self.costs[value] = solve(trial, moved, max_iterations=ITERATIONS, hold=self.hold).cost
            except SolveError:
                self.costs[value] = float("inf")
        return self.costs[value]

    def _vertex(self, best: float) -> float | None:
        """Lowest point of the parabola through the best value and its neighbours."""
        values = sorted(self.costs)
        i = values.index(best)
        if not 0 < i < len(values) - 1:
            return None
        near = values[i - 1 : i + 2]
        a, b, _ = np.polyfit(np.array(near) - best, [self.costs[value] for value in near], 2)
        return best - b / (2.0 * a) if np.isfinite(a) and a > 0.0 else None


def placed(problems: Sequence[BagProblem], values: dict[str, float]) -> list[BagProblem]:
    """The problems with their samples where some values put them."""
    moved = [BagProblem.of(problem.robot.with_values(values), problem.recording) for problem in problems]
    return [replace(new, owner=old.owner) for new, old in zip(moved, problems, strict=True)]


def _shifts(robot: Robot) -> list[str]:
    """Full names of the free delays and offsets of a robot."""
    found = []
    for here in robot.effects:
        if isinstance(here.effect, TimeShift):
            start = here.parameter("")
            found += [n for n, p in robot.parameters.items() if n.startswith(start) and p.unit == "s" and not p.fixed]
    return found


def _one_sided(robot: Robot, name: str) -> bool:
    """Whether only values above zero are physical."""
    for here in robot.effects:
        for p in here.effect.parameters_at(robot, here.owner):
            if here.parameter(p.name) == name:
                return p.sign == "+"
    return False


def _with_value(estimate: Estimate, name: str, value: float) -> Estimate:
    """The estimate with another value of a parameter."""
    calibrations = []
    for calibration in estimate.calibrations:
        i, dynamics = calibration.names.index(name), calibration.dynamics.copy()
        dynamics[i] = np.log(value) if calibration.positive[i] else value
        calibrations.append(calibration.with_points({DYNAMICS: dynamics}))
    return Estimate(estimate.states, tuple(calibrations))
