# SPDX-License-Identifier: BSD-3-Clause
"""The filters of encoders: held until the noise is known, then found by the cost of several of them.

Readings of a filter hang on accelerations. While the process noise is loose these follow every sample, and the longest
filter, which asks for the least of them, costs least. Where the noise is small, friction that turns over has kinks
there that no iteration crosses. The cost of solutions with given filters has neither trouble: it is a parabola.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibration_summary import Solved
from jointscope.graphs.calibration.whole_stage import WholeStage, anchored
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot

TRIED = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0]) * 1e-3  # [s] time constants of first order
ITERATIONS = 12  # of each trial
PARABOLAS = 3  # at the most
NEAR = 0.03  # relative change of a variance that changes nothing
ROUNDS = 3  # of a filter, and of the noise that is found with it


def free_filters(robot: Robot) -> tuple[str, ...]:
    """Full names of the variances that a calibration looks for."""
    filters = [here for here in robot.effects if isinstance(here.effect, SmoothedReading)]
    names = [here.parameter(here.effect.variance) for here in filters if isinstance(here.effect, SmoothedReading)]
    return tuple(name for name in names if not robot.parameters[name].fixed)


def with_filters(robot: Robot, values: dict[str, float], fixed: bool) -> Robot:
    """The robot with these variances, held or free."""
    own = {n: replace(robot.parameters[n], value=value, fixed=fixed) for n, value in values.items()}
    return replace(robot, parameters={**robot.parameters, **own})


def solved_with_filters(stage: WholeStage, held: Solved, names: tuple[str, ...]) -> Solved:
    """The solution with filters free, from the one with filters held.

    Args:
        stage: solves.
        held: where the robot's filters are held at their start.
        names: of their variances.
    """
    values = {name: held.robot.parameters[name].value for name in names}
    for _ in range(ROUNDS):
        before = dict(values)
        for name in names:
            values = _Trials(stage, held, values, name).best()
        robot = with_filters(held.robot, values, fixed=True)
        held = _settled(stage, held, robot)
        if all(abs(values[name] - before[name]) < NEAR * before[name] for name in names):
            break
    return _settled(stage, held, with_filters(held.robot, values, fixed=False))


def _settled(stage: WholeStage, solved: Solved, robot: Robot) -> Solved:
    """The solution of another robot from here."""
    estimate = solved.solution.estimate
    calibrations = tuple(c.carried_to(Calibration.of(robot)) for c in estimate.calibrations)
    problems = anchored([p.of_robot(robot) for p in solved.problems], calibrations)
    noise = solved.problems[0].dynamics.steps.noise
    return stage.settled(problems, noise, Estimate(estimate.states, calibrations))


@dataclass
class _Trials:
    """Costs by the variance of one filter, all other values free, the noise as it is."""

    stage: WholeStage
    solved: Solved
    values: dict[str, float]
    name: str
    costs: dict[float, float] = field(default_factory=dict)

    def best(self) -> dict[str, float]:
        """All variances, with that of this filter where the cost is lowest."""
        start = self.solved.solution.estimate
        estimate = start
        for variance in sorted({*(TRIED**2).tolist(), self.values[self.name]}):
            estimate = self._tried(variance, estimate)
            if self.costs[variance] > max(4.0 * min(self.costs.values()), 1.0):
                break  # far beyond
        for _ in range(PARABOLAS):
            lowest = min(self.costs, key=self.costs.__getitem__)
            between = _vertex(self.costs, lowest)
            if between is None or abs(between - lowest) < NEAR * lowest:
                break
            self._tried(between, start)
        return {**self.values, self.name: min(self.costs, key=self.costs.__getitem__)}

    def _tried(self, variance: float, estimate: Estimate) -> Estimate:
        robot = with_filters(self.solved.robot, {**self.values, self.name: variance}, fixed=True)
        problems = anchored([p.of_robot(robot) for p in self.solved.problems], estimate.calibrations)
        noise = self.solved.problems[0].dynamics.steps.noise
        try:
            solution = self.stage.step("filters of encoders", problems, noise, estimate, ITERATIONS)
        except SolveError:
            self.costs[variance] = float("inf")
            return estimate
        self.costs[variance] = solution.cost
        return solution.estimate


def _vertex(costs: dict[float, float], lowest: float) -> float | None:
    """Lowest point of the parabola through a value and its neighbours; None at an end."""
    values = sorted(costs)
    i = values.index(lowest)
    if not 0 < i < len(values) - 1:
        return None
    near = np.array(values[i - 1 : i + 2])
    a, b, _ = np.polyfit(near - lowest, [costs[value] for value in near.tolist()], 2)
    return float(lowest - b / (2.0 * a)) if np.isfinite(a) and a > 0.0 else None
