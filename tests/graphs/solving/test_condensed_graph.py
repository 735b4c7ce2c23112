# SPDX-License-Identifier: BSD-3-Clause
"""Condensed factors against the same samples without condensation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving import banded_solver, inner_states, solver_context, stretch
from jointscope.graphs.solving.banded_solver import eliminate, eliminations_of
from jointscope.graphs.solving.batch_solver import reduced_system, solve, total_cost
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.damped_step import damped_step
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import build, costs
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.robots.errors import SolveError


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


def reduced(graph, values, *damping):
    """Hessian and right side that the states leave on the shared values."""
    _, rest = graph.linearized(values, *damping).eliminatePartialSequential(graph.states_ordering)
    return rest.hessian(graph.shared_ordering)


def assert_alike(one, other):
    """To the last digit."""
    for a, b in zip(one, other, strict=True):
        assert np.array_equal(a, b)


@pytest.mark.parametrize("long", [0, 20_000])
def test_a_rejected_step_leaves_the_graph_as_if_it_had_not_been_tried(moving, long, monkeypatch):
    """A trial takes the memory of the linearisation that it follows from, until a first one is rejected."""
    monkeypatch.setattr(stretch, "LONG", long)
    problems, estimate = moving
    (tried, values), (fresh, _) = (CondensedGraph.of(problems, estimate, length=60) for _ in range(2))
    steps = [damped_step(tried, values, damping).values for damping in (1e-9, 10.0, 0.1)]
    begin = tried.cost(values)
    tried.linearized(values)
    costs = [[tried.cost(step), tried.cost(values)] for step in steps]
    assert [cost for _, cost in costs] == [begin] * 3
    fresh.linearized(values)
    assert [cost for cost, _ in costs] == pytest.approx(
        [fresh.cost(step) for step in steps], rel=1e-12
    )  # sums in another order
    assert_alike(*(reduced(graph, steps[-1]) for graph in (tried, fresh)))


def test_costs_without_derivatives_are_those_of_the_normal_equations(moving):
    for problem, x, calibration in zip(moving[0], moving[1].states, moving[1].calibrations, strict=True):
        system = build(problem, x, calibration)
        assert costs(problem, x, calibration) == pytest.approx(system.costs, rel=1e-9, abs=1e-9 * system.cost)


@pytest.mark.parametrize("long", [0, 20_000])
def test_after_a_rejected_step_the_next_is_linearised_only_where_it_is_accepted(moving, long, monkeypatch):
    monkeypatch.setattr(stretch, "LONG", long)
    problems, estimate = moving
    graph, values = CondensedGraph.of(problems, estimate, length=1000)
    built = []
    monkeypatch.setattr(inner_states, "build", lambda *args, **into: built.append(1) or build(*args, **into))
    step = damped_step(graph, values, 1e-9).values
    for damping in (1e-9, 10.0):  # the first trial is linearised, of each of two recordings, and rejected
        graph.cost(step)
        step = damped_step(graph, values, damping).values
    again = 2 if long == 0 else 0  # where memory is scarce, the first trial took that of the linearisation
    assert len(built) == 2 + again
    cost = graph.cost(step)
    assert len(built) == 2 + again
    accepted = damped_step(graph, step, 1e-9).values
    assert len(built) == 4 + again
    fresh, _ = CondensedGraph.of(problems, estimate, length=1000)
    fresh.linearized(values, 10.0**1.5 / 1e12)
    assert fresh.cost(step) == pytest.approx(cost, rel=1e-12)
    assert fresh.cost(damped_step(fresh, step, 1e-9).values) == pytest.approx(graph.cost(accepted), rel=1e-12)


@pytest.mark.parametrize("long", [0, 20_000])
@pytest.mark.parametrize("bent", [False, True])
def test_damping_that_was_not_expected_is_heeded(moving, bent, long, monkeypatch):
    monkeypatch.setattr(stretch, "LONG", long)
    problems, estimate = moving
    (told, values), (surprised, _) = (CondensedGraph.of(problems, estimate, length=60) for _ in range(2))
    bends = [np.where(np.arange(len(x)) % 7 == 0, 1e-3 * bent, 0.0) for x in estimate.states]
    step = damped_step(told, values, 1e-9).values
    damped_step(surprised, values, 1e-9)
    told.expect(1e-9, bends)
    found = []
    for graph in (told, surprised):
        graph.cost(step)
        found.append(reduced(graph, step, 1e-9, bends))
    assert_alike(*found)


def test_a_long_recording_is_solved_like_a_short_one(moving, monkeypatch):
    problems, estimate = moving
    found = []
    for long in (0, 20_000):
        monkeypatch.setattr(stretch, "LONG", long)
        solution = solve(problems, estimate, length=60)
        found.append((solution.cost, *solution.estimate.states, solution.estimate.calibrations[0].values))
    for one, other in zip(*found, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9)


def test_a_state_that_nothing_tells_is_named_in_a_long_recording_too(moving, monkeypatch):
    problems, estimate = moving
    monkeypatch.setattr(stretch, "LONG", 0)
    problem = problems[0]
    steps = replace(problem.dynamics.steps, free=np.full((len(problem.dynamics), 6), np.inf))
    blind = [replace(problem, placed=problem.placed[:1], dynamics=replace(problem.dynamics, steps=steps))]
    graph, values = CondensedGraph.of(blind, Estimate(estimate.states[:1], estimate.calibrations[:1]))
    with pytest.raises(SolveError, match="is not determined by the recording"):
        graph.linearized(values)


@pytest.mark.parametrize("threads", [2, 3])
def test_no_result_depends_on_the_number_of_threads(moving, threads, monkeypatch):
    problems, estimate = moving
    found = []
    for count in (1, threads):
        monkeypatch.setattr(solver_context, "thread_count", lambda count=count: count)
        solution = solve(problems, estimate, max_iterations=3, length=50)
        found.append((solution.cost, *solution.estimate.states, solution.estimate.calibrations[0].values))
    assert_alike(*found)


def test_states_that_are_eliminated_part_by_part_leave_what_the_whole_leaves(moving, monkeypatch):
    problems, estimate = moving
    monkeypatch.setattr(banded_solver, "PART", 60)
    bags = zip(problems, estimate.states, estimate.calibrations, strict=True)
    for found, bag in zip(eliminations_of(problems, estimate), bags, strict=True):
        whole = eliminate(build(*bag))
        for name in ("columns", "W", "w", "S", "s"):
            reference = getattr(whole, name)
            assert getattr(found, name) == pytest.approx(reference, abs=1e-9 * np.abs(reference).max()), name


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
