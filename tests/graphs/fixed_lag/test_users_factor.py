# SPDX-License-Identifier: BSD-3-Clause
"""A factor of one's own in the window of the estimator."""

from __future__ import annotations

import gtsam
import numpy as np
import pytest
from online_doggy import feed

from jointscope.graphs.fixed_lag import FixedLagEstimator
from jointscope.robots.errors import EstimatorError

SIGMA = 1e-5


@pytest.fixture
def est(run):
    """An estimator that has followed a tenth of a second of motion."""
    found = FixedLagEstimator(run.robot, 0.05)
    feed(found, run.messages(0.75, 0.9))
    found.state()
    return found


def measured(key, place, value, sigma=SIGMA):
    """A measurement of one component of the state."""

    def error(this, values, H):
        x = values.atVector(key)
        if H is not None:
            H[0] = np.asfortranarray(np.eye(len(x))[place : place + 1])
        return x[place : place + 1] - value

    return gtsam.CustomFactor(gtsam.noiseModel.Isotropic.Sigma(1, sigma), [key], error)


def test_the_newest_state_takes_a_users_measurement_in_as_a_kalman_step_would(est):
    before = est.state()
    place = int(est.layout.joint_q[1])
    value = before.mean[place] + 3.0 * before.sigma[place]
    est.add(measured(est.key(), place, value, before.sigma[place]))
    after = est.state()
    column = before.covariance[:, place]
    gain = column / (column[place] + before.covariance[place, place])
    change = gain * (value - before.mean[place])
    assert after.mean == pytest.approx(before.mean + change, abs=1e-6 * np.abs(change).max())
    wanted = before.covariance - np.outer(gain, column)
    assert after.covariance == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())
    assert est.newest_of_window().mean == pytest.approx(after.mean, abs=1e-9)


def test_a_users_measurement_of_the_past_moves_the_newest_state_and_the_smoothed_one(est):
    before, smoothed = est.state(), est.smoothed()
    place = int(est.layout.joint_v[0])
    est.add(measured(est.key(smoothed.time), place, smoothed.mean[place] + smoothed.sigma[place]))
    assert est.smoothed().mean[place] - smoothed.mean[place] == pytest.approx(smoothed.sigma[place], rel=1e-2)
    assert not np.array_equal(est.state().mean, before.mean)


def test_a_factor_between_two_states_sees_the_states_themselves(est):
    """The link's way over 20 ms, measured: both states see it whole."""
    newest = est.state()
    keys, place = [est.key(newest.time - 0.02), est.key()], int(est.layout.joint_q[0])
    seen = []

    def error(this, values, H):
        first, last = (values.atVector(key) for key in keys)
        seen.append((first, last))
        if H is not None:
            row = np.eye(len(first))[place : place + 1]
            H[0], H[1] = np.asfortranarray(-row), np.asfortranarray(row)
        return last[place : place + 1] - first[place : place + 1] - 0.01

    est.add(gtsam.CustomFactor(gtsam.noiseModel.Isotropic.Sigma(1, 1e-9), keys, error))
    assert seen[-1][1][: est.layout.size] == pytest.approx(newest.mean, abs=1e-9)
    first = seen[-1][0][place]
    assert abs(first - newest.mean[place]) > 1e-4
    again = []
    est.add(measured_pair(keys, again))
    assert again[-1][1][place] - again[-1][0][place] == pytest.approx(0.01, abs=1e-6)


def measured_pair(keys, seen):
    """Says nothing, and looks at two states."""

    def error(this, values, H):
        seen.append(tuple(values.atVector(key) for key in keys))
        if H is not None:
            for i, x in enumerate(seen[-1]):
                H[i] = np.asfortranarray(np.zeros((1, len(x))))
        return np.zeros(1)

    return gtsam.CustomFactor(gtsam.noiseModel.Isotropic.Sigma(1, 1.0), keys, error)


def test_what_a_user_added_stays_while_the_estimator_goes_on(run, est):
    plain = FixedLagEstimator(run.robot, 0.05)
    feed(plain, run.messages(0.75, 0.9))
    place, bias = int(est.layout.size), 0.02
    t = est.state().time
    est.add(measured(est.key(t), place, bias, 1e-6))
    messages = run.messages(0.9, 0.93)
    feed(est, messages)
    feed(plain, messages)
    gyro = est.robot.gyros[0].name
    assert est.state().biases[gyro][0] == pytest.approx(bias, abs=1e-4)
    assert abs(plain.state().biases[gyro][0] - bias) > 1e-3


def test_keys_that_are_not_in_the_window_are_errors_that_say_what_it_holds(est):
    newest = gtsam.Symbol(est.key()).index()
    ahead = measured(gtsam.symbol("x", newest + 50), 0, 0.0)
    with pytest.raises(
        EstimatorError, match=rf"touches x{newest + 50}, which is not there yet; the window holds x\d+ \("
    ):
        est.add(ahead)
    with pytest.raises(EstimatorError, match=r"touches x1, which has left it; .* use `est.key\(t\)`"):
        est.add(measured(gtsam.symbol("x", 1), 0, 0.0))
    with pytest.raises(EstimatorError, match=r"touches d0, which the estimator lacks"):
        est.add(measured(gtsam.symbol("d", 0), 0, 0.0))
    with pytest.raises(EstimatorError, match=r"no tick at 0\.2 s; the window goes from 0\.8\d+ to 0\.8"):
        est.key(0.2)


def test_a_factor_that_does_not_fit_the_state_changes_nothing(est):
    before = est.state()
    noise = gtsam.noiseModel.Unit.Create(2)
    with pytest.raises(EstimatorError, match=r"cannot be evaluated .*a state has 18 numbers"):
        est.add(gtsam.PriorFactorVector(est.key(), np.zeros(2), noise))
    wild = measured(est.key(), 0, np.nan)
    with pytest.raises(EstimatorError, match=r"has the error nan at these values"):
        est.add(wild)
    for shape in ((1, 3), (2, 18)):

        def bent(this, values, H, shape=shape):
            if H is not None:
                H[0] = np.asfortranarray(np.ones(shape))
            return np.zeros(1)

        said = rf"of shape \({shape[0]}, {shape[1]}\) by x\d+; expected \(1, 18\)"
        with pytest.raises(EstimatorError, match=said):
            est.add(gtsam.CustomFactor(gtsam.noiseModel.Unit.Create(1), [est.key()], bent))
    assert np.array_equal(est.state().mean, before.mean)


def test_before_the_first_state_there_is_no_key(run):
    fresh = FixedLagEstimator(run.robot, 0.05)
    with pytest.raises(EstimatorError, match=r"no state yet"):
        fresh.key()
    with pytest.raises(EstimatorError, match=r"no state yet"):
        fresh.add(measured(gtsam.symbol("x", 0), 0, 0.0))
