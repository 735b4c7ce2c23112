# SPDX-License-Identifier: BSD-3-Clause
"""Recordings and candidates on a Dask cluster that is there already."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.discovery.side_by_side import SideBySide
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.spread.spread_solver import SpreadSolver
from jointscope.graphs.starts.initial_guess import initial_biases, initial_states
from jointscope.graphs.workers import dask_cluster
from jointscope.graphs.workers.dask_cluster import DaskCluster
from jointscope.robots.errors import ClusterError
from jointscope.robots.files.effect_catalogue import find_effect

distributed = pytest.importorskip("distributed", reason="clusters need the extra `cluster`")

ITERATIONS = 5


@pytest.fixture(scope="module")
def address():
    """A cluster of two processes on this machine."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        yield cluster.scheduler_address


@pytest.fixture(scope="module")
def two(simulated, doggy):
    """Two pieces of a motion as recordings, with a start that is off."""
    truth = {k: v for k, v in simulated.truth["parameters"].items() if k in doggy.parameters}
    robot = doggy.with_values({k: 1.1 * v for k, v in truth.items()})
    problems = [BagProblem.of(robot, simulated.recording.between(t, t + 1.3)) for t in (2.0, 6.0)]
    calibrations = [initial_biases(p, Calibration.of(robot)) for p in problems]
    states = [initial_states(p, c) for p, c in zip(problems, calibrations, strict=True)]
    return problems, Estimate(tuple(states), tuple(calibrations))


def assert_same(one, other):
    assert one.cost == pytest.approx(other.cost, rel=1e-9)
    for a, b in zip(one.estimate.calibrations, other.estimate.calibrations, strict=True):
        np.testing.assert_allclose(a.dynamics, b.dynamics, rtol=1e-9, atol=1e-12)
    for a, b in zip(one.estimate.states, other.estimate.states, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11)


def test_a_cluster_gives_what_one_process_gives_also_where_a_worker_dies(address, two):
    alone, killed = solve(*two, max_iterations=ITERATIONS), []

    def kill_one(text, share):
        if text.startswith("iteration 3"):
            killed.append(crew._client.submit(os.getpid, workers=[crew.of_slot[1]], pure=False).result())
            os.kill(killed[0], signal.SIGKILL)

    with DaskCluster(address) as crew:
        assert_same(SpreadSolver(crew)(*two, max_iterations=ITERATIONS, hold=(), progress=None), alone)
        assert_same(SpreadSolver(crew)(*two, max_iterations=ITERATIONS, hold=(), progress=kill_one), alone)
    assert killed


def test_candidates_are_fitted_on_a_cluster_in_their_order(address):
    with DaskCluster(address) as crew, SideBySide(cluster=crew) as pool:
        assert list(pool.in_order(divmod, 100, [7, 9, 11])) == [divmod(100, 7), divmod(100, 9), divmod(100, 11)]
        results = pool.in_order(divmod, 100, [7, 0])
        assert next(results) == (14, 2)
        with pytest.raises(ZeroDivisionError):
            next(results)


def test_workers_know_the_effects_of_the_user(address, tmp_path):
    file = tmp_path / "my_effects.py"
    lines = ["from dataclasses import replace", "from jointscope.robots.effects.cogging import EFFECT as OTHER"]
    file.write_text("\n".join([*lines, "EFFECT = replace(OTHER, id='my_cogging')"]))
    with DaskCluster(address, [file]) as crew:
        assert crew.submit(0, find_effect, "my_cogging").result().id == "my_cogging"


def test_who_does_not_answer_is_named_at_once():
    with pytest.raises(ClusterError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9 .*dask scheduler"):
        DaskCluster("tcp://127.0.0.1:9")


@pytest.mark.parametrize("address", ["nonsense", "", "tcp://", "http://127.0.0.1", "tcp://host"])
def test_what_is_no_address_is_told_before_anybody_is_asked(address):
    with pytest.raises(ClusterError, match="expected an address like tcp://host:8786"):
        DaskCluster(address)


def test_another_version_is_named_at_once(address, monkeypatch):
    monkeypatch.setattr(dask_cluster, "version_here", lambda package: "0.0.1")
    with pytest.raises(ClusterError, match=r"has distributed .*expected 0\.0\.1 as here"):
        DaskCluster(address)
