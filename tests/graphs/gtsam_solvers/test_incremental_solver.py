# SPDX-License-Identifier: BSD-3-Clause
"""A calibration stretch after stretch by iSAM2 against the batch."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.gtsam_solvers.incremental_solver import Incremental, incrementally
from jointscope.graphs.solving.batch_solver import Solution, solve


@pytest.fixture(scope="module")
def both(simulated, doggy):
    """Two recordings of two seconds, calibrated in both ways, with what was told on the way."""
    parts = [simulated.recording.between(t, t + 2.0) for t in (3.0, 5.5)]
    robot = replace(doggy, noise=replace(doggy.noise, estimate=False))
    told = []
    incremental = calibrate(robot, parts, solver=Incremental(told.append))
    return SimpleNamespace(batch=calibrate(robot, parts), incremental=incremental, told=told)


@pytest.mark.slow
def test_incremental_ends_where_the_batch_ends(both):
    assert both.incremental.cost == pytest.approx(both.batch.cost, abs=5e-5)  # what a hundredth of a sigma costs
    for one, other in zip(both.incremental.parameters, both.batch.parameters, strict=True):
        assert one.value == pytest.approx(other.value, abs=1e-3 * other.sigma), one.name
        assert one.sigma == pytest.approx(other.sigma, rel=1e-3), one.name
    for one, other in zip(both.incremental.bags, both.batch.bags, strict=True):
        assert np.max(np.abs(one.states - other.states) / other.sigmas) < 1e-2


@pytest.mark.slow
def test_more_is_known_after_every_stretch(both):
    told = both.told
    assert [known.stretch for known in told] == list(range(1, told[0].stretches + 1))
    assert told[0].stretches >= 8
    sigmas = np.array([known.sigmas for known in told])
    assert np.all(sigmas[-1] < 0.9 * sigmas[0])
    assert np.all(sigmas[-1] < 1.02 * sigmas.min(axis=0))


@pytest.mark.slow
def test_what_is_said_of_a_value_on_the_way_holds_in_the_end(both):
    told = both.told
    last = told[-1]
    for known in told[1:]:
        assert np.all(np.abs(known.calibration.values - last.calibration.values) < 5.0 * known.sigmas)


def test_isam2_alone_ends_within_a_thousandth_of_a_sigma(simulated, doggy, monkeypatch):
    """The steps that the batch's own end asks for change next to nothing."""
    ends = []

    def watched(problems, start, *, first, **kwargs) -> Solution:
        def second(graph, values):
            ends.append(first(graph, values))
            return ends[-1]

        solution = solve(problems, start, first=second, **kwargs)
        ends.append(solution)
        return solution

    monkeypatch.setattr("jointscope.graphs.gtsam_solvers.incremental_solver.solve", watched)
    robot = replace(doggy, noise=replace(doggy.noise, estimate=False))
    calibrate(robot, [simulated.recording.between(4.0, 6.0)], solver=Incremental(lambda known: None))
    steps = [i.step_in_sigmas for i in ends[-1].iterations]
    assert len(steps) <= 2
    assert max(steps) < 1e-3


def test_values_that_isam2_made_worse_are_not_taken(simulated, doggy, monkeypatch):
    def astray(graph, values, told):
        found = incrementally(graph, values, told)
        key = graph.dynamics_key
        found.update(key, found.atVector(key) + 1.0)
        return found

    robot = replace(doggy, noise=replace(doggy.noise, estimate=False))
    part = simulated.recording.between(4.0, 5.0)
    right = calibrate(robot, [part])
    monkeypatch.setattr("jointscope.graphs.gtsam_solvers.incremental_solver.incrementally", astray)
    found = calibrate(robot, [part], solver=Incremental(lambda known: None))
    assert found.cost == pytest.approx(right.cost, rel=1e-6)


def test_where_isam2_runs_away_the_batch_begins_at_the_start_values(simulated, doggy, monkeypatch):
    robot = replace(doggy, noise=replace(doggy.noise, estimate=False))
    part = simulated.recording.between(4.0, 5.0)
    right = calibrate(robot, [part])

    def runs_away(smoother, added, new, keys):
        raise RuntimeError("Indeterminant linear system detected")

    monkeypatch.setattr("jointscope.graphs.gtsam_solvers.incremental_solver._settle", runs_away)
    said = []
    found = calibrate(robot, [part], solver=Incremental(lambda known: None, said.append))
    assert found.cost == pytest.approx(right.cost, rel=1e-6)
    assert said == [
        "iSAM2 runs away at stretch 1 of 8: start values may be far off, or the model contradicts the recording; "
        "all stretches are solved together instead"
    ]
