# SPDX-License-Identifier: BSD-3-Clause
"""The filter by rounds of linear steps is the one that runs tick by tick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import jointscope as js
from jointscope.graphs.comparison import causal_filter
from jointscope.graphs.comparison.causal_filter import FilteredStates, filter_around, filter_states
from jointscope.graphs.comparison.compare import smooth
from jointscope.graphs.kernels import filter_kernel
from jointscope.graphs.problem.sensor_placement import Placed

DIFFERENT = 1e-4  # [sigma]


@pytest.fixture(scope="module")
def solved(doggy):
    """A second of a robot whose friction the model does not know."""
    pytest.importorskip("mujoco")
    from jointscope.tools.simulator import simulate

    hidden = ["load_dependent_friction@joint2:coefficient=0.25"]
    return smooth(doggy, simulate(doggy, "moves", 1.2, seed=5, friction="smooth", effects=hidden).recording)


def test_rounds_of_linear_steps_end_where_the_filter_tick_by_tick_does(solved, monkeypatch):
    problem, x, calibration = solved
    monkeypatch.setattr(causal_filter, "CHUNK", 500)  # several stretches
    monkeypatch.setattr(causal_filter, "BURN_IN", 10.0)
    monkeypatch.setattr(causal_filter, "_starts", lambda _, first, __: 0 * first)  # where the recording begins
    slow = causal_filter._tick_by_tick(problem, filter_around(problem, x, calibration), calibration)
    fast = filter_states(problem, calibration, x)
    sigma = np.sqrt(np.einsum("kii->ki", slow.covariance))
    assert np.max(np.abs(fast.mean - slow.mean) / sigma) < DIFFERENT
    np.testing.assert_allclose(np.sqrt(np.einsum("kii->ki", fast.covariance)), sigma, rtol=DIFFERENT)


def test_where_rounds_do_not_settle_the_filter_runs_tick_by_tick(solved, monkeypatch):
    problem, x, calibration = solved
    asked, found = [], FilteredStates(x, np.zeros((0, 0, 0)))
    monkeypatch.setattr(causal_filter, "ROUNDS", 1)
    monkeypatch.setattr(causal_filter, "_tick_by_tick", lambda *args: asked.append(args) or found)
    assert filter_states(problem, calibration, x) is found
    assert len(asked) == 1


@pytest.mark.filterwarnings("error")
def test_steps_that_could_not_be_taken_are_not_read(solved, monkeypatch):
    """What a run that broke off never wrote may be any number: it is worth neither a warning nor a decision."""
    problem, x, calibration = solved
    unwritten = -np.ones((len(x), x.shape[1], x.shape[1]))
    monkeypatch.setattr(filter_kernel, "filter_steps", lambda *args: (x, unwritten, False))
    monkeypatch.setattr(causal_filter, "_tick_by_tick", lambda _, begin, __: begin)
    around = filter_around(problem, x, calibration)
    np.testing.assert_array_equal(filter_states(problem, calibration, x).mean, around.mean)


@pytest.mark.filterwarnings("error")
def test_linear_steps_begin_at_the_first_state_that_is_known(solved):
    """Of the states before the first sample nothing is known, which is no reason to run all others tick by tick."""
    problem, x, calibration = solved
    sensors = problem.robot.sensors
    later = [_without(one, one.ticks == 0) for one in problem.placed if one.factor.name in sensors]
    behind = replace(problem, placed=tuple(later))
    begin = filter_around(behind, x, calibration)
    assert not np.any(np.isfinite(begin.covariance[0]))
    known = int(np.argmax(np.isfinite(begin.covariance[:, 0, 0])))
    found = causal_filter._settled(behind, begin, calibration)
    assert found is not None
    assert np.all(np.isfinite(found.mean[known:]))
    assert np.all(np.isfinite(found.covariance[known:]))


def _without(placed: Placed, dropped: np.ndarray) -> Placed:
    kept = np.flatnonzero(~dropped)
    return Placed(placed.factor.select(kept), placed.ticks[kept], placed.times[kept])


@pytest.mark.slow
def test_a_link_that_rests_in_the_middle_of_its_backlash_is_followed_once_it_moves(doggy):
    """Linear steps from a rest in which the link may be anywhere in the gap learn one of its ends, and keep to it."""
    pytest.importorskip("mujoco")
    hidden = ["backlash@joint3:half_gap=0.01"]
    simulated = js.simulate(doggy, motion="moves", seconds=4.0, seed=2, friction="smooth", effects=hidden)
    true = simulated.truth["parameters"]
    robot = js.add(doggy, "backlash@joint3")
    known = {name: replace(p, value=true[name], sigma=1e-6) for name, p in robot.parameters.items()}
    mounted = {
        gyro.name: replace(
            gyro, R_imu_body=np.array(true[f"{gyro.name}.R_imu_body"]), bias=np.array(true[f"{gyro.name}.bias"])
        )
        for gyro in robot.gyros
    }
    noise = replace(
        robot.noise, link_velocity=np.full(3, 1e-3), motor_velocity=np.full(3, 1e-3)
    )  # as calibrations find
    robot = replace(robot, parameters=known, sensors={**robot.sensors, **mounted}, noise=noise)
    compared = js.compare(robot, simulated).models[0]
    assert compared.error < 1.1 * compared.floor < 1.2
