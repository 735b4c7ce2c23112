# SPDX-License-Identifier: BSD-3-Clause
"""Recordings on workers give what they give in one process, also where a worker dies."""

from __future__ import annotations

import multiprocessing
import os
import signal

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.spread.spread_solver import SpreadSolver, spread_evenly
from jointscope.graphs.starts.initial_guess import initial_biases, initial_states
from jointscope.graphs.workers.local_processes import LocalProcesses
from jointscope.robots.errors import SolveError

ITERATIONS = 6


@pytest.fixture(scope="module")
def three(simulated, doggy):
    """Three pieces of a motion as recordings, with a start that is off."""
    truth = {k: v for k, v in simulated.truth["parameters"].items() if k in doggy.parameters}
    robot = doggy.with_values({k: 1.1 * v for k, v in truth.items()})
    problems = [BagProblem.of(robot, simulated.recording.between(t, t + 1.3)) for t in (2.0, 4.0, 6.0)]
    calibrations = [initial_biases(p, Calibration.of(robot)) for p in problems]
    states = [initial_states(p, c) for p, c in zip(problems, calibrations, strict=True)]
    return problems, Estimate(tuple(states), tuple(calibrations))


@pytest.fixture(scope="module")
def alone(three):
    """The solution of one process."""
    return solve(*three, max_iterations=ITERATIONS)


def assert_same(one, other):
    """But for rounding: last digits of linear algebra depend on where in memory matrices lie."""
    assert one.cost == pytest.approx(other.cost, rel=1e-12)
    assert len(one.iterations) == len(other.iterations) and one.converged == other.converged
    for a, b in zip(one.estimate.calibrations, other.estimate.calibrations, strict=True):
        np.testing.assert_allclose(a.values, b.values, rtol=1e-9)
    for a, b in zip(one.estimate.states, other.estimate.states, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)


def spread_over(crew, three, progress=None):
    return SpreadSolver(crew)(*three, max_iterations=ITERATIONS, hold=(), progress=progress)


def test_two_processes_give_what_one_gives(three, alone):
    with LocalProcesses(2) as crew:
        assert_same(spread_over(crew, three), alone)


def test_a_process_that_is_killed_in_the_middle_costs_nothing_but_time(three, alone):
    killed = []

    def kill_one(text, share):
        children = multiprocessing.active_children()
        if text.startswith("iteration 4") and children:
            os.kill(children[0].pid, signal.SIGKILL)
            killed.append(children[0].pid)

    with LocalProcesses(2) as crew:
        assert_same(spread_over(crew, three, kill_one), alone)
    assert len(killed) == 1


def test_an_error_of_a_worker_is_the_solvers(three):
    problems, start = three
    lost = [x.copy() for x in start.states]
    lost[1][40] = np.nan
    with LocalProcesses(2) as crew, pytest.raises(SolveError, match="not finite"):
        spread_over(crew, (problems, Estimate(tuple(lost), start.calibrations)))


def test_the_longest_recordings_are_apart():
    assert spread_evenly([10, 40, 30, 20], 2) == [0, 0, 1, 1]
    assert spread_evenly([5, 5], 4) == [0, 1]
