# SPDX-License-Identifier: BSD-3-Clause
"""The estimator on clean data: errors as large as it says, the window agrees, starts, predictions, misuse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from online_doggy import feed, simulated_run, told

from jointscope.graphs.fixed_lag import FixedLagEstimator
from jointscope.robots.errors import EstimatorError
from jointscope.robots.files.effect_editing import add_effect

REST, MOTION = 0.45, 0.8  # [s] when the robot rests, and when it moves


def nees_over(run, est, messages):
    """Normalised errors squared at every tick after the first tenth of a second."""
    found = []
    begin = messages[0][1] + 0.1
    feed(est, messages, lambda t: found.append(run.nees(est.state(t))) if t > begin else None)
    return np.array(found)


@pytest.fixture(scope="module")
def followed(run):
    """The estimator after half a second of motion, its ticks, and all smoothed states."""
    ticks, smoothed = [], []

    def listener(tick):
        ticks.append(tick)
        smoothed.append(tick.smoothed(covariance=len(ticks) % 50 == 0))

    est = FixedLagEstimator(run.robot, 0.1, listener=listener)
    nees = nees_over(run, est, run.messages(REST, 1.1))
    return est, ticks, smoothed, nees


def test_errors_are_as_large_as_the_covariance_says(followed):
    nees = followed[3]
    # errors stay alike for some 20 ms: about 25 independent states of 12 dimensions
    assert 0.7 < nees.mean() < 1.4
    assert nees.max() < 5.0


@pytest.mark.parametrize("memory", [0.02, 0.1])
def test_errors_are_as_large_as_the_covariance_says_where_torques_last(memory):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    run = simulated_run(seconds=1.6, memory=memory)
    nees = nees_over(run, FixedLagEstimator(run.robot, 0.1), run.messages(REST, 1.6))
    assert 0.7 < nees.mean() < 1.4
    white = replace(run.robot, noise=run.robot.noise.white)
    assert nees_over(run, FixedLagEstimator(white, 0.1), run.messages(REST, 0.9)).mean() > 5.0


def test_innovations_are_as_large_as_expected(followed):
    est, ticks, _, _ = followed
    found = [i for tick in ticks[100:] for i in tick.innovations]
    assert {i.sensor for i in found} == set(est.robot.sensors)
    assert 0.85 < sum(i.nis for i in found) / sum(i.dof for i in found) < 1.15
    assert all(i.used for i in found)
    assert 0.8 < est.status.nis_mean < 1.2
    assert set(est.status.nis) == {c for s in est.robot.sensors.values() for c in s.channels}
    assert est.status.alarms == ()


def test_the_newest_state_is_that_of_the_window(followed):
    est = followed[0]
    newest, window = est.state(), est.newest_of_window()
    scale = newest.sigma
    np.testing.assert_allclose(newest.mean / scale, window.mean / scale, atol=1e-4)
    np.testing.assert_allclose(
        newest.covariance / np.outer(scale, scale), window.covariance / np.outer(scale, scale), atol=1e-6
    )


def test_smoothed_states_are_at_the_lag_and_better_than_the_newest(run, followed):
    _, ticks, smoothed, _ = followed
    velocities = run.robot.layout.velocities
    lagged = [s for s in smoothed if s is not None]
    assert smoothed[0] is None and len(lagged) > 450
    assert all(0.09 <= tick.state.time - s.time <= 0.1 + 1e-9 for tick, s in zip(ticks, smoothed, strict=True) if s)
    late = np.array([s.mean - run.truth(s.time) for s in lagged if s.time > 0.6])[:, velocities]
    new = np.array([t.state.mean - run.truth(t.state.time) for t in ticks if t.state.time > 0.6])[:, velocities]
    assert np.sqrt((late**2).mean()) < 0.85 * np.sqrt((new**2).mean())


def test_covariance_at_the_lag_is_honest_and_given_where_asked(run, followed):
    smoothed = [s for s in followed[2] if s is not None]
    asked = [s for s in smoothed if np.isfinite(s.covariance).all()]
    assert len(asked) < len(smoothed) / 40
    assert 0.5 < np.mean([run.nees(s) for s in asked]) < 1.6


def test_everything_that_came_is_counted(run, followed):
    est, ticks, _, _ = followed
    count = len([m for m in run.messages(REST, 1.1) if m[0] == "command"])
    assert dict(est.status.received) == {name: count for name in ("command", *est.robot.sensors)}
    assert est.status.dropped == {}
    assert sum(est.status.late.values()) == 0
    assert est.status.updates == len(ticks) and est.status.restarts == 0
    begun = ticks[0].state.time - 1e-3
    assert told(est, "started") == [f"states are estimated from {begun:.3f} s on"]
    assert begun == pytest.approx(REST + 0.02, abs=1.5e-3)


def test_it_starts_in_motion(run):
    est = FixedLagEstimator(run.robot, 0.1)
    nees = nees_over(run, est, run.messages(MOTION, MOTION + 0.25))
    assert np.abs(run.truth(MOTION)[run.robot.layout.joint_v]).max() > 1.0
    assert 0.3 < nees.mean() < 2.0


def test_the_first_state_in_motion_does_not_claim_too_much(run):
    for begin in np.arange(0.55, 1.5, 0.1):
        est = FixedLagEstimator(run.robot, 0.1)
        for name, t, values in run.messages(begin):
            est.sample(name, t, values)
            if est.status.running:
                break
        assert np.abs(run.error(est.state())).max() < 4.0


def test_before_the_start_nothing_is_claimed(run):
    est = FixedLagEstimator(run.robot, 0.1)
    state = est.state(3.0)
    assert state.time == 3.0 and np.all(np.isinf(np.diag(state.covariance))) and state.age == np.inf
    q = np.array([0.1, 0.2, 0.3])
    est.encoder(4.0, q)
    assert not est.status.running
    state = est.state()
    np.testing.assert_array_equal(state.q_motor, q - est.robot.motor_encoder.zero)
    assert np.all(np.isinf(state.sigma))
    assert est.smoothed() is None and est.newest_of_window() is None
    # a controller may look at these from the beginning
    assert set(state.biases) == set(state.bias_sigmas) == {"imu1", "imu2"} and state.parameters == {}
    adapting = FixedLagEstimator(run.robot, adapt={"motor.k_mi": 0.1}).state()
    assert adapting.parameters["motor.k_mi"][0] == run.robot.parameters["motor.k_mi"].value


def test_a_prediction_leads_where_the_robot_goes_and_says_how_well(run):
    est = feed(FixedLagEstimator(run.robot, 0.1), run.messages(MOTION, 1.0))
    now = est.state()
    errors = []
    for ahead in (0.002, 0.005, 0.01):
        there = est.state(now.time + ahead)
        assert there.time == now.time + ahead and there.age == pytest.approx(now.age + ahead)
        assert np.all(there.sigma[run.robot.layout.velocities] > now.sigma[run.robot.layout.velocities])
        errors.append(run.nees(there))
    # commands after the newest are not known: the last is held
    assert max(errors) < 4.0
    np.testing.assert_array_equal(est.state().mean, now.mean)


def test_far_ahead_nothing_is_known(run):
    est = feed(FixedLagEstimator(run.robot, 0.1), run.messages(REST, REST + 0.04))
    near, far = est.state(REST + 0.3), est.state(REST + 10.0)
    assert np.isfinite(near.covariance).all()
    assert np.all(np.isinf(np.diag(far.covariance))) and far.time == REST + 10.0
    np.testing.assert_allclose(far.q_motor, est.state().q_motor)
    assert est.status.running


def test_a_time_in_the_past_gives_the_newest_state(run):
    est = feed(FixedLagEstimator(run.robot, 0.1), run.messages(REST, REST + 0.05))
    newest = est.state()
    np.testing.assert_array_equal(est.state(REST).mean, newest.mean)
    assert est.state(REST).time == newest.time


# misuse


def test_an_impossible_lag_is_refused(run):
    for lag in (0.0, -0.1, np.nan, np.inf):
        with pytest.raises(EstimatorError) as err:
            FixedLagEstimator(run.robot, lag)
        assert str(err.value) == f"lag is {lag:g} s; expected a positive number of seconds, such as 0.1"


def test_an_unknown_sensor_is_refused_with_a_list_of_those_there_are(run):
    with pytest.raises(EstimatorError) as err:
        FixedLagEstimator(run.robot).gyro("imu7", 0.0, np.zeros(3))
    assert str(err.value) == "no sensor 'imu7'; robot 'doggy' has command, motor_encoder, imu1, imu2"


@pytest.mark.parametrize("shape", [(2,), (4,), (1, 3), ()])
def test_a_wrong_shape_is_refused(run, shape):
    est = FixedLagEstimator(run.robot)
    for name in ("command", "motor_encoder", "imu1"):
        with pytest.raises(EstimatorError) as err:
            est.sample(name, 0.0, np.zeros(shape))
        assert str(err.value) == f"{name}: expected 3 values, got an array of shape {shape}"
    assert not est.status.received


def test_what_is_no_number_is_refused(run):
    est = FixedLagEstimator(run.robot)
    with pytest.raises(EstimatorError) as err:
        est.encoder(0.0, ["a", "b", "c"])
    assert str(err.value) == "motor_encoder: expected a stamp [s] and 3 numbers, got 0.0 and ['a', 'b', 'c']"
    with pytest.raises(EstimatorError) as err:
        est.command(None, [0.0, 0.0, 0.0])
    assert str(err.value) == "command: expected a stamp [s] and 3 numbers, got None and [0.0, 0.0, 0.0]"


def test_a_state_at_no_time_is_refused(run):
    with pytest.raises(EstimatorError) as err:
        FixedLagEstimator(run.robot).state(float("nan"))
    assert str(err.value) == "state at nan s: expected a finite time, or None for the newest"


def test_only_parameters_of_the_motion_can_be_adapted(run):
    robot = add_effect(run.robot, "command_delay@robot")
    names = ", ".join(robot.parameters)
    delay = next(name for name in robot.parameters if "command_delay" in name)
    wrong = {
        "nonsense": f"no parameter 'nonsense' to adapt; robot 'doggy' has {names}",
        delay: f"{delay} cannot be adapted: command_delay@robot acts on stamps, readings or commands",
    }
    for name, text in wrong.items():
        with pytest.raises(EstimatorError) as err:
            FixedLagEstimator(robot, adapt={name: 0.1})
        assert str(err.value) == text
    for density in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(EstimatorError) as err:
            FixedLagEstimator(robot, adapt={"motor.k_mi": density})
        expected = f"adapting motor.k_mi needs a positive density of its walk [unit/sqrt(s)]; got {density:g}"
        assert str(err.value) == expected
