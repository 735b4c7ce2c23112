# SPDX-License-Identifier: BSD-3-Clause
"""One estimate from recordings of two kinds: motion, and a kind that the core has never heard of."""

from __future__ import annotations

import gtsam
import numpy as np
import pytest
from weighed_springs import ZERO, WeighedSprings

from jointscope.factors.calibration import Calibration, rotation_block
from jointscope.factors.single import block_key
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.batch_solver import Solution, newton_step, solve, total_cost
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.set_problem import linearized, owners
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.starts.initial_guess import initial_states

STIFFNESS, DIAL = 118.0, 2e-3


@pytest.fixture(scope="module")
def kinds(simulated, doggy):
    """Half a second of motion and ten weighings, off their minimum."""
    robot = doggy.with_values({name: 1.05 * p.value for name, p in doggy.parameters.items()})
    motion = BagProblem.of(robot, simulated.recording.between(5.0, 5.5))
    torques = np.linspace(-1.0, 3.0, 10)
    noise = np.random.default_rng(0).normal(size=10) * 1e-3
    weights = WeighedSprings(robot, "joint1", torques, torques / STIFFNESS + DIAL + noise)
    calibration = Calibration.of(robot)
    x, own = weights.start(calibration)
    start = Estimate((initial_states(motion, calibration), x), (calibration, own))
    return [motion, weights], start


def only(start: Estimate, i: int) -> Estimate:
    return Estimate((start.states[i],), (start.calibrations[i],))


def solved(problems, start):
    solution = solve(problems, start, max_iterations=60, step_tolerance=1e-4)
    assert solution.converged
    return solution


def covariance_at(problems, estimate, systems):
    """Of all shared values if these recordings were all there is, at an estimate."""
    shared = SharedLayout.of(estimate.calibrations, owners(problems))
    return posteriors(problems, Solution(estimate, float("nan"), shared), (), [eliminate(s) for s in systems])[1]


def test_a_kind_of_its_own_is_solved_without_any_motion(kinds):
    (_, weights), start = kinds
    solution = solved([weights], only(start, 1))
    i = start.calibrations[1].names.index("joint1.stiffness")
    found, sigma = solution.estimate.calibrations[0].dynamics[i], np.sqrt(posteriors([weights], solution)[1][i, i])
    expected = weights.sigma[0] * STIFFNESS / np.linalg.norm(weights.torques - weights.torques.mean())
    assert sigma == pytest.approx(expected, rel=0.1) and abs(found - np.log(STIFFNESS)) < 3.5 * sigma
    assert solution.shared.size == start.calibrations[1].size


def test_kinds_share_one_stiffness_and_either_alone_knows_less(kinds):
    problems, start = kinds
    solution = solved(problems, start)
    i = start.calibrations[0].names.index("joint1.stiffness")
    _, covariance = posteriors(problems, solution)
    bags = zip(problems, solution.estimate.states, solution.estimate.calibrations, strict=True)
    systems = [linearized(*bag) for bag in bags]
    motion, weights = (
        covariance_at(problems[k : k + 1], only(solution.estimate, k), systems[k : k + 1])[i, i] for k in (0, 1)
    )
    together = covariance[i, i]
    assert motion > 1.05 * together and weights > 1.05 * together
    # information adds up; the prior is part of both
    prior = problems[0].robot.parameters["joint1.stiffness"]
    assert 1 / together == pytest.approx(1 / motion + 1 / weights - (prior.prior / prior.prior_sigma) ** 2, rel=1e-6)


def test_values_that_only_one_kind_sees_each_are_correlated(kinds):
    problems, start = kinds
    solution = solved(problems, start)
    _, covariance = posteriors(problems, solution)
    shared = solution.shared
    assert ZERO not in shared.places[0] and rotation_block("imu1") not in shared.places[1]
    # the dial's zero is seen by weights alone, the mounting of a gyro and the damping by motion alone
    zero, damping = shared.places[1][ZERO].start, start.calibrations[0].names.index("joint1.damping")
    correlation = covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert 1e-4 < abs(correlation[zero, damping]) < 1.0
    assert np.abs(correlation[zero, shared.places[0][rotation_block("imu2")]]).max() > 1e-9


def test_gtsam_tells_the_same_sigmas_of_values_that_one_kind_sees(kinds):
    problems, start = kinds
    solution = solved(problems, start)
    graph, values = CondensedGraph.of(problems, solution.estimate)
    assert graph.cost(values) == pytest.approx(total_cost(problems, solution.estimate), rel=1e-12)
    _, covariance = posteriors(problems, solution)
    marginals = gtsam.Marginals(graph.graph, values)
    own = block_key(ZERO, start.calibrations[1], 1)
    place = solution.shared.places[1][ZERO]
    assert marginals.marginalCovariance(own) == pytest.approx(covariance[place, place], rel=1e-4)
    # two condensed motions or one, and one factor for all weighings
    assert sum(len(cuts) for cuts in graph.stretches) == 2


def test_states_of_a_set_end_where_its_equations_put_them(kinds):
    problems, start = kinds
    solution = solved(problems, start)
    i = start.calibrations[0].names.index("joint1.stiffness")
    K = np.exp(solution.estimate.calibrations[1].dynamics[i])
    assert solution.estimate.states[1][:, 0] * K == pytest.approx(problems[1].torques, abs=1e-2)
    step = newton_step(problems, solution)
    assert step.in_sigmas < 1e-3
    assert np.abs(step.dx[1]).max() < 1e-3 * problems[1].sigma[0]
