# SPDX-License-Identifier: BSD-3-Clause
"""Steps where GTSAM refuses to eliminate a state that is known, but weakly."""

from __future__ import annotations

import gtsam
import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.damped_step import damped_step
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.starts.initial_guess import initial_states


class Refusing:
    """A Gaussian graph whose states GTSAM takes for indeterminate."""

    def __init__(self, graph: gtsam.GaussianFactorGraph):
        self._graph = graph

    def eliminatePartialSequential(self, ordering):
        raise RuntimeError("Indeterminate linear system detected")

    def hessian(self, ordering):
        return self._graph.hessian(ordering)


@pytest.fixture
def moving(simulated, doggy):
    """Two pieces off their minimum."""
    robot = doggy.with_values({name: 1.1 * p.value for name, p in doggy.parameters.items()})
    problems = [BagProblem.of(robot, simulated.recording.between(t, t + 0.25)) for t in (5.0, 6.0)]
    calibration = Calibration.of(robot)
    states = tuple(initial_states(problem, calibration) for problem in problems)
    return problems, Estimate(states, (calibration, calibration))


@pytest.mark.parametrize("hold", [(), ("dynamics",)])
def test_a_step_is_the_same_whoever_eliminates(moving, hold, monkeypatch):
    problems, estimate = moving
    graph, values = CondensedGraph.of(problems, estimate, hold, length=60)
    expected = damped_step(graph, values, 1e-3)
    linearized = CondensedGraph.linearized
    monkeypatch.setattr(CondensedGraph, "linearized", lambda *args: Refusing(linearized(*args)))
    found = damped_step(graph, values, 1e-3)
    assert found.in_sigmas == pytest.approx(expected.in_sigmas, rel=1e-6)
    change, wanted = values.localCoordinates(found.values), values.localCoordinates(expected.values)
    for key in values.keys():
        scale = np.abs(wanted.at(key)).max()
        assert change.at(key) == pytest.approx(wanted.at(key), abs=1e-5 * scale + 1e-12), gtsam.DefaultKeyFormatter(key)
