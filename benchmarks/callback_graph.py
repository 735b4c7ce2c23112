# SPDX-License-Identifier: BSD-3-Clause
"""The plain graph, for comparison: one Python callback per sample, linearised and eliminated by GTSAM.

Two ways to drive it. With values that Python owns, a callback reads them in place; inside GTSAM's own optimizer every
callback receives a copy of all values, which makes an iteration quadratic in the number of samples.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import gtsam

from jointscope.factors.calibration import Calibration
from jointscope.graphs.gtsam_solvers.reference_graph import initial_values, nonlinear_graph
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.batch_solver import Solution, newton_step, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import build
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


@dataclass(frozen=True)
class Cost:
    """Seconds of one iteration.

    Attributes:
        seconds: length of the recording [s].
        linearize: of the callbacks, or of the batch [s].
        eliminate: of the linear system, back-substitution included [s].
    """

    seconds: float
    linearize: float
    eliminate: float

    @property
    def total(self) -> float:
        """Whole iteration [s]."""
        return self.linearize + self.eliminate


@in_solver_context
def near_solution(robot: Robot, recording: Recording) -> tuple[BagProblem, Estimate]:
    """A problem and a point near its minimum, where one iteration costs what it costs in the end."""
    problem = BagProblem.of(robot, recording)
    calibration = Calibration.of(robot)
    start = Estimate((initial_states(problem, calibration),), (calibration,))
    return problem, solve([problem], start, max_iterations=2).estimate


@in_solver_context
def batch_iteration(problem: BagProblem, estimate: Estimate, repeats: int = 3) -> Cost:
    """One iteration of the batch solver; the fastest of some."""
    costs = []
    x, calibration = estimate.states[0], estimate.calibrations[0]
    for _ in range(repeats):
        started = time.perf_counter()
        system = build(problem, x, calibration)
        built = time.perf_counter()
        shared = SharedLayout.of(calibration, 1)
        newton_step([problem], Solution(estimate, system.cost, shared), eliminations=[eliminate(system)])
        costs.append(Cost(problem.recording.duration, built - started, time.perf_counter() - built))
    return min(costs, key=lambda cost: cost.total)


def python_loop_iteration(problem: BagProblem, estimate: Estimate) -> Cost:
    """One iteration of a Gauss-Newton loop in Python: `graph.linearize`, then GTSAM's elimination."""
    graph, values = nonlinear_graph([problem], estimate), initial_values(estimate)
    started = time.perf_counter()
    linear = graph.linearize(values)
    linearized = time.perf_counter()
    values.retract(linear.optimize())
    return Cost(problem.recording.duration, linearized - started, time.perf_counter() - linearized)


def optimizer_iteration(problem: BagProblem, estimate: Estimate) -> Cost:
    """One iteration of `gtsam.LevenbergMarquardtOptimizer`, which does not tell its parts apart."""
    graph, values = nonlinear_graph([problem], estimate), initial_values(estimate)
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(1)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters)
    started = time.perf_counter()
    optimizer.iterate()
    return Cost(problem.recording.duration, time.perf_counter() - started, 0.0)
