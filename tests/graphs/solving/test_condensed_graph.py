# SPDX-License-Identifier: BSD-3-Clause
"""Condensed factors against the same samples without condensation."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.batch_solver import reduced_system, total_cost
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.damped_step import damped_step
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import build
from jointscope.graphs.starts.initial_guess import initial_states


@pytest.fixture(scope="module")
def moving(simulated, doggy):
    """Two pieces of a quarter of a second each, off their minimum."""
    robot = doggy.with_values({name: 1.1 * p.value for name, p in doggy.parameters.items()})
    problems = [BagProblem.of(robot, simulated.recording.between(t, t + 0.25)) for t in (5.0, 6.0)]
    calibration = Calibration.of(robot)
    states = tuple(initial_states(problem, calibration) for problem in problems)
    return problems, Estimate(states, (calibration, calibration))


@pytest.mark.parametrize("length", [50, 100, 1000])
def test_the_cost_does_not_depend_on_where_recordings_are_cut(moving, length):
    problems, estimate = moving
    graph, values = CondensedGraph.of(problems, estimate, length=length)
    assert graph.cost(values) == pytest.approx(total_cost(problems, estimate), rel=1e-12)


@pytest.mark.parametrize("length", [50, 1000])
def test_what_the_states_leave_on_the_shared_values_is_that_of_the_whole_band(moving, length):
    problems, estimate = moving
    graph, values = CondensedGraph.of(problems, estimate, length=length)
    _, rest = graph.linearized(values).eliminatePartialSequential(graph.states_ordering)
    H, right = rest.hessian(graph.shared_ordering)
    systems = [build(p, x, c) for p, x, c in zip(problems, estimate.states, estimate.calibrations, strict=True)]
    wanted, gradient = reduced_system(problems, [eliminate(s) for s in systems], graph.shared, estimate.calibrations)
    index = np.concatenate([index for _, index in graph.shared_keys])
    scale = np.sqrt(np.diag(wanted))[index]
    reduced, wanted_step = np.ravel(right) / scale, -gradient[index] / scale
    assert reduced == pytest.approx(wanted_step, abs=1e-6 * np.abs(wanted_step).max())
    assert H / scale / scale[:, None] == pytest.approx(wanted[np.ix_(index, index)] / scale / scale[:, None], abs=1e-8)


def test_the_joined_systems_of_stretches_are_the_system_of_the_recording(moving):
    problems, estimate = moving
    graph, values = CondensedGraph.of(problems, estimate, length=60)
    graph.cost(values)
    for joined, problem, x, calibration in zip(
        graph.systems(estimate), problems, estimate.states, estimate.calibrations, strict=True
    ):
        whole = build(problem, x, calibration)
        for name in ("D", "E", "B", "C", "g_x", "g_p"):
            reference = getattr(whole, name)
            assert getattr(joined, name) == pytest.approx(reference, abs=1e-9 * np.abs(reference).max()), name
        assert joined.cost == pytest.approx(whole.cost, rel=1e-12)


def test_inner_states_follow_a_step_of_the_shared_values(moving):
    problems, estimate = moving
    long, short = (CondensedGraph.of(problems, estimate, length=length) for length in (1000, 40))
    steps = [damped_step(graph, values, 1e-9) for graph, values in (long, short)]
    costs = [graph.cost(step.values) for (graph, _), step in zip((long, short), steps, strict=True)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)
    first, second = (graph.estimate(step.values) for (graph, _), step in zip((long, short), steps, strict=True))
    for x, y in zip(first.states, second.states, strict=True):
        assert x == pytest.approx(y, abs=1e-6 * np.abs(x).max())


def test_a_held_block_is_no_variable(moving):
    problems, estimate = moving
    graph, values = CondensedGraph.of(problems, estimate, hold=(DYNAMICS,))
    assert all("dynamics" not in blocks for blocks in graph.blocks)
    assert graph.cost(values) == pytest.approx(total_cost(problems, estimate), rel=1e-12)
    moved = graph.estimate(damped_step(graph, values, 1e-9).values)
    assert np.array_equal(moved.calibrations[0].dynamics, estimate.calibrations[0].dynamics)
