# SPDX-License-Identifier: BSD-3-Clause
"""Streams as they really come: late, twice, not at all, wrong, with clocks that jump. Each test breaks one thing."""

from __future__ import annotations

import numpy as np
import pytest
from online_doggy import dropped, feed, told

from jointscope.graphs.fixed_lag import FixedLagEstimator

BEGIN, END = 0.75, 1.05  # [s] in motion
TRUSTED = 3.0  # normalised error squared per degree of freedom; 2.7 is passed by one state in a thousand


@pytest.fixture(scope="module")
def messages(run):
    return run.messages(BEGIN, END)


@pytest.fixture(scope="module")
def clean(run, messages):
    """The state at the end of undisturbed data."""
    return feed(FixedLagEstimator(run.robot, 0.1), messages).state()


def after(run, messages, lag=0.1):
    est = feed(FixedLagEstimator(run.robot, lag), messages)
    return est, est.state()


def same(state, other, share):
    """Whether two states differ by less than a share of a standard deviation, and so do their covariances."""
    np.testing.assert_allclose(state.mean / other.sigma, other.mean / other.sigma, atol=share)
    np.testing.assert_allclose(state.sigma, other.sigma, rtol=share)


# rates and order


def test_sensors_of_other_rates_and_between_ticks_are_used_where_they_were_taken(odd_run):
    est, nees = FixedLagEstimator(odd_run.robot, 0.1), []
    feed(est, odd_run.messages(0.45), lambda t: nees.append(odd_run.nees(est.state())) if t > 0.6 else None)
    assert 0.6 < np.mean(nees) < 1.6
    assert 0.85 < est.status.nis_mean < 1.15
    assert est.status.used["imu1"] < est.status.used["motor_encoder"] / 4
    assert not est.status.dropped


ALL = ("command", "motor_encoder", "imu1", "imu2")


# the weight of an encoder sample in slow motion depends on those that came before it, so order matters a little there
@pytest.mark.parametrize(("late", "share"), [(("command",), 0.1), (("imu1", "imu2"), 0.1), (ALL, 0.4)])
def test_messages_out_of_order_give_what_those_in_order_give(run, messages, late, share):
    rng = np.random.default_rng(1)
    arrival = [m[1] + (rng.uniform(0.0, 5e-3) if m[0] in late else 0.0) for m in messages]
    shuffled = [messages[i] for i in np.argsort(arrival, kind="stable")]
    est, ordered = (feed(FixedLagEstimator(run.robot, 0.1), each) for each in (shuffled, messages))
    state, expected = est.state(END), ordered.state(END)
    assert np.sqrt(np.mean(((state.mean - expected.mean) / expected.sigma) ** 2)) < share
    np.testing.assert_allclose(state.sigma, expected.sigma, rtol=0.1)
    assert all(est.status.late[name] > 50 for name in late)
    assert run.nees(est.state()) < TRUSTED
    # of the first messages some come before the first state
    assert sum(dropped(est, "too_late").values()) <= 20 and set(est.status.dropped) <= set(late)
    assert run.nees(est.smoothed()) < TRUSTED


def test_repeated_messages_count_once(run, messages, clean):
    est, state = after(run, [m for m in messages for _ in range(2)])
    same(state, clean, 1e-9)
    assert dropped(est, "duplicate") == {name: len(messages) // 4 for name in est.status.received}
    assert "imu1: two messages with one stamp; the first counts" in told(est, "duplicate")


def test_what_comes_after_its_window_is_left_out_and_counted(run, messages, clean):
    head, tail = messages[:-200], messages[-200:]
    forgotten = [(name, t - 0.1497, values) for name, t, values in tail[:40]]
    est, state = after(run, [*head, *forgotten, *tail])
    same(state, clean, 1e-9)
    assert dropped(est, "too_late") == dict.fromkeys(est.status.received, 10)
    assert est.status.restarts == 0


# values


def test_values_that_are_not_finite_are_left_out(run, messages):
    rng = np.random.default_rng(2)
    spoilt, expected = [], 0
    for name, t, values in messages:
        if name != "command" and rng.uniform() < 0.2 and t > BEGIN + 0.03:
            values = values.copy()
            values[rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf, 1e200])
            expected += 1
        spoilt.append((name, t, values))
    est, state = after(run, spoilt)
    assert sum(dropped(est, "not_finite").values()) == expected
    assert run.nees(state) < TRUSTED
    assert est.status.restarts == 0


def test_a_command_that_is_not_finite_is_as_if_it_were_missing(run, messages):
    spoilt = [(n, t, np.full(3, np.nan) if n == "command" and abs(t - 0.95) < 1e-4 else v) for n, t, v in messages]
    missing = [m for m in messages if not (m[0] == "command" and abs(m[1] - 0.95) < 1e-4)]
    est, state = after(run, spoilt)
    assert dropped(est, "not_finite") == {"command": 1}
    same(state, after(run, missing)[1], 1e-9)


def test_a_command_of_one_joint_that_is_no_number_leaves_the_others_theirs(run, messages):
    lost = {0.900, 0.950, 0.951, 0.952}

    def changed(name, t, values, value):
        if name != "command" or min(abs(t - at) for at in lost) > 1e-4:
            return values
        values = values.copy()
        values[1] = value
        return values

    kept, held = None, []
    for name, t, values in messages:
        if name == "command":
            hit = min(abs(t - at) for at in lost) < 1e-4
            kept = kept if hit else values[1]
        held.append((name, t, changed(name, t, values, kept)))
    est, state = after(run, [(name, t, changed(name, t, values, np.nan)) for name, t, values in messages])
    assert dropped(est, "not_finite") == {"command": 4}
    assert told(est, "not_finite")[0] == "the command of joint2 is no number and is left out"
    same(state, after(run, held)[1], 1e-9)


def test_encoder_glitches_are_refused(run, messages, clean):
    spoilt, glitches = [], (0.85, 0.95, 1.0, 1.001)
    for name, t, values in messages:
        if name == "motor_encoder" and np.abs(np.array(glitches) - t).min() < 1e-4:
            values = values + np.array([0.0, 0.05, 0.0])
        spoilt.append((name, t, values))
    est, state = after(run, spoilt)
    assert dropped(est, "outlier") == {"motor_encoder": len(glitches)}
    assert told(est, "outlier")[0].startswith("joint2.motor_position: ")
    np.testing.assert_allclose(state.mean / clean.sigma, clean.mean / clean.sigma, atol=1.0)
    assert run.nees(state) < TRUSTED


def test_a_stuck_gyro_is_left_out_and_does_not_pull(run, messages):
    held = {}
    stuck = []
    for name, t, values in messages:
        if name == "imu2" and t > 0.85:
            values = held.setdefault(name, values)
        stuck.append((name, t, values))
    est = FixedLagEstimator(run.robot, 0.1)
    worst = []
    feed(est, stuck, lambda t: worst.append(run.nees(est.state())) if t > 0.9 else None)
    assert dropped(est, "stuck")["imu2"] > 150
    assert np.mean(worst) < TRUSTED
    assert told(est, "stuck") == ["imu2 repeats one value: saturated or dead; it is left out"]


def test_a_jump_of_the_encoders_is_followed_in_the_end(run, messages):
    """Zero shifts by 0.05 rad: a model that contradicts its encoders must not lock itself in."""
    offset = np.array([0.05, 0.0, 0.0])
    spoilt = [(n, t, v + offset if n == "motor_encoder" and t > 0.85 else v) for n, t, v in messages]
    est, state = after(run, spoilt)
    expected = run.truth(state.time)[run.robot.layout.motor_q] + offset
    np.testing.assert_allclose(state.q_motor, expected, atol=2e-3)
    assert est.status.running


# silence


def test_a_gyro_that_dies_is_told_and_comes_back(run):
    est = FixedLagEstimator(run.robot, 0.1)
    everything = run.messages(BEGIN, 1.35)
    nees = []
    dead = [m for m in everything if not (m[0] == "imu2" and 0.85 < m[1] < 1.25)]
    feed(est, dead, lambda t: nees.append(run.nees(est.state())) if t > 0.9 else None)
    assert np.mean(nees) < 2.0
    assert est.status.lost == ()
    assert [e.kind for e in est.events if e.source == "imu2"] == ["sensor_lost", "sensor_back"]
    assert told(est, "sensor_back") == ["imu2 is back after 0.40 s"]


def test_dead_encoders_leave_growing_uncertainty_and_come_back(run):
    est = FixedLagEstimator(run.robot, 0.1)
    feed(est, [m for m in run.messages(BEGIN, 1.15) if not (m[0] == "motor_encoder" and m[1] > 0.9)])
    blind = est.state()
    assert est.status.lost == ("motor_encoder",)
    assert np.all(blind.sigma[run.robot.layout.motor_q] > 1e-4)
    assert run.nees(blind) < TRUSTED
    feed(est, run.messages(1.15, 1.25))
    seeing = est.state()
    assert est.status.lost == () and est.status.restarts == 0
    assert run.nees(seeing) < TRUSTED
    assert np.all(seeing.sigma[run.robot.layout.motor_q] < 3e-5)


def test_when_commands_stop_the_state_goes_on_and_its_covariance_tells_the_truth(run):
    """Commands are lost on the way to the estimator; the robot moves on with them."""
    est, nees = FixedLagEstimator(run.robot, 0.1), []
    kept = [m for m in run.messages(BEGIN, 1.3) if not (m[0] == "command" and m[1] > 0.9)]
    feed(est, kept, lambda t: nees.append(run.nees(est.state())) if t > 1.1 else None)
    assert est.state().time > 1.29
    assert np.mean(nees) < TRUSTED
    assert est.status.lost == ("command",)
    assert est.status.restarts == 0
    feed(est, run.messages(1.3, 1.4))
    assert told(est, "command_back") == ["command is back after 0.40 s"]
    assert run.nees(est.state()) < TRUSTED


def test_a_short_gap_of_everything_is_bridged(run):
    pieces = [m for m in run.messages(BEGIN, END) if not 0.9 < m[1] < 0.95]
    est, state = after(run, pieces)
    assert est.status.restarts == 0
    assert run.nees(state) < TRUSTED


def test_a_long_gap_begins_anew_and_keeps_the_biases(run):
    est = feed(FixedLagEstimator(run.robot, 0.1), run.messages(0.45, 0.9))
    known = est.state().bias_sigmas["imu1"]
    feed(est, run.messages(1.3, 1.45))
    state = est.state()
    assert est.status.running and est.status.restarts == 1
    assert told(est, "restarted")[0].endswith("; the estimator begins anew, biases are kept")
    assert np.all(state.bias_sigmas["imu1"] < 1.2 * known)
    assert run.nees(state) < TRUSTED


# clocks


@pytest.mark.parametrize("shift", [-0.7, -1e6, 5.0, 1e6])
def test_a_clock_that_is_set_is_followed(run, shift):
    est = feed(FixedLagEstimator(run.robot, 0.1), run.messages(BEGIN, 0.9))
    feed(est, [(name, t + shift, values) for name, t, values in run.messages(0.9, 1.1)])
    state = est.state()
    assert est.status.running and est.status.restarts == 1
    assert state.time == pytest.approx(1.099 + shift, abs=2e-3)
    assert state.age == pytest.approx(0.0, abs=2e-3)
    e = state.mean - run.truth(state.time - shift)
    assert e @ np.linalg.solve(state.covariance, e) / len(e) < TRUSTED
    assert "the stamps of the encoders went from 0.8" in told(est, "restarted")[0]
    # what watches the streams lives at the new time, too
    feed(est, [(n, t + shift, v) for n, t, v in run.messages(1.1, 1.35) if n != "imu1"])
    assert est.status.lost == ("imu1",)
    assert 0.5 < est.status.nis_mean < 2.0


@pytest.mark.parametrize("shift", [-1e6, -5.0, 5.0, 1e6, 1e9])
def test_one_wild_stamp_of_each_stream_changes_nothing(run, messages, clean, shift):
    wild = [(name, t + shift, values) for name, t, values in messages[600:604]]
    est, state = after(run, [*messages[:600], *wild, *messages[604:]])
    assert est.status.restarts == 0 and est.status.running
    assert dropped(est, "too_late" if shift < 0 else "too_early") == dict.fromkeys(est.status.received, 1)
    np.testing.assert_allclose(state.mean / clean.sigma, clean.mean / clean.sigma, atol=0.5)
    assert state.age < 1e-6


def test_wild_stamps_before_the_start_do_not_stay(run, messages):
    wild = [("command", 1e9, np.ones(3)), ("motor_encoder", 1e9, np.zeros(3)), ("imu1", 1e9, np.zeros(3))]
    est, state = after(run, [*messages[:20], *wild, *messages[20:]])
    assert est.status.running and est.status.restarts == 0
    assert run.nees(state) < TRUSTED and state.age < 1e-6


def test_a_stamp_that_is_no_time_is_left_out(run, messages, clean):
    wild = [(name, t, np.ones(3)) for name in ("command", "motor_encoder", "imu1") for t in (np.nan, np.inf, -np.inf)]
    est, state = after(run, [*messages[:600], *wild, *messages[600:]])
    same(state, clean, 1e-9)
    assert dropped(est, "not_finite") == {"command": 3, "motor_encoder": 3, "imu1": 3}


# a robot whose commands come slowly


def test_commands_at_100_hz_are_held_and_steps_stay_short(run):
    """The robot rests, so that commands which are left out were the same."""
    est, ticks = FixedLagEstimator(run.robot, 0.1, listener=lambda tick: ticks.append(tick.state.time)), []
    slow = [m for m in run.messages(0.1, 0.45) if m[0] != "command" or round(m[1] * 1e3) % 10 == 0]
    feed(est, slow)
    assert np.diff(ticks).max() < 4.001e-3
    assert est.status.used["motor_encoder"] > 320
    assert run.nees(est.state()) < TRUSTED
    assert est.status.nis_mean < 1.3  # at rest samples of the quantized encoder share errors and count for less


@pytest.mark.slow
def test_a_gyro_with_a_wrong_clock_raises_an_alarm(run):
    """Stamps of one gyro are 50 ms ahead: the estimate suffers, and says so."""
    shifted = [(t, n, t + (0.05 if n == "imu2" else 0.0), v) for n, t, v in run.messages(0.45, 0.9)]
    est = FixedLagEstimator(run.robot, 0.1)
    kinds = set()
    for _, name, stamp, values in shifted:
        est.sample(name, stamp, values)
        kinds |= {event.kind for event in est.events[-3:]}
    assert "alarm" in kinds and "outlier" in kinds
