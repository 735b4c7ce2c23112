# SPDX-License-Identifier: BSD-3-Clause
"""Errors put in on purpose, in one regime or along one signal, must be found there; white noise must stay unsaid."""

from __future__ import annotations

import time

import numpy as np
import pytest

from jointscope.graphs.comparison.comparison_result import ModelComparison, SensorPrediction
from jointscope.graphs.comparison.error_concentration import concentration
from jointscope.graphs.comparison.failure_analysis import analyse_failure
from jointscope.graphs.noise.whiteness_test import evenly, whiteness
from jointscope.graphs.problem.joint_states import JointStates
from jointscope.graphs.problem.motion_regimes import REGIMES, motion_regimes
from jointscope.robots.recordings.recording import Recording, Stream

FREQUENCY = np.array([0.23, 0.61, 0.37])  # [Hz]
AMPLITUDE = np.array([0.8, 0.3, 0.4])  # [rad]
DAMPED = 150.0  # [1/s^2] acceleration over deflection


def synthetic(doggy, error=None, seconds=20.0, seed=0, states=True):
    """Sinusoids at 1 kHz, predicted perfectly but for sensor noise and `error(sensor name, motion)` on top."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(1000 * seconds)) * 1e-3
    w = 2.0 * np.pi * FREQUENCY
    angle = w * t[:, None] + np.array([0.3, 1.0, 2.0])
    q, v, deflection = (
        AMPLITUDE * np.sin(angle),
        AMPLITUDE * w * np.cos(angle),
        AMPLITUDE * w**2 * np.sin(angle) / DAMPED,
    )
    motion = JointStates(t, q, v, deflection, 150.0 * deflection)
    streams = {"command": Stream("command", t, np.cos(3.0 * angle), tuple(f"{j}.command" for j in doggy.joints), "1")}
    sensors = {}
    for name, sensor in doggy.sensors.items():
        clean = q if name == doggy.motor_encoder.name else 0.5 * v
        measured = clean + sensor.sigmas * rng.standard_normal(clean.shape)
        if error is not None:
            measured = measured + error(name, motion)
        streams[name] = Stream(name, t, measured, sensor.channels, sensor.units[0])
        ahead, soon = np.full(clean.shape, np.nan), np.full(clean.shape, np.nan)
        ahead[600::10], soon[600::10] = clean[600::10], clean[600::10]
        sensors[name] = SensorPrediction(
            sensor.channels, sensor.units, sensor.sigmas, t, measured, clean, ahead, soon if states else None
        )
    recording = Recording("synthetic", "", 0, streams)
    kept = {"motion": motion, "predicted_motion": motion.at(t[600::10])} if states else {}
    return ModelComparison("doggy", doggy, 1.0, 1.0, {}, (), sensors, **kept), recording


def on(doggy, channel, signal):
    """An error on one channel: signal(motion) in SI units."""
    name = next(n for n, s in doggy.sensors.items() if channel in s.channels)
    column = doggy.sensors[name].channels.index(channel)

    def error(sensor, motion):
        added = np.zeros(motion.q.shape)
        if sensor == name:
            added[:, column] = signal(motion)
        return added

    return error


def near_reversals(joint):
    return lambda motion: 0.05 * (np.abs(motion.v[:, joint]) < 0.03 * np.max(np.abs(motion.v[:, joint])))


def test_a_model_that_lacks_nothing_gets_no_sentence(doggy):
    analysis = analyse_failure(*synthetic(doggy))
    assert analysis.sentences == ()
    assert set(analysis.channels) == set(doggy.channels)
    assert all(0.9 < failure.error < 1.1 for failure in analysis.channels.values())
    assert all(failure.whiteness_p > 1e-3 for failure in analysis.channels.values())
    assert set(analysis.time_in_regime) == set(REGIMES)


@pytest.mark.parametrize("joint", ["joint1", "joint2", "joint3"])
def test_an_error_at_the_reversals_of_one_joint_is_found_there(doggy, joint):
    error = on(doggy, "imu2.y", near_reversals(doggy.joints.index(joint)))
    analysis = analyse_failure(*synthetic(doggy, error))
    failure = analysis.channels["imu2.y"]
    assert next(iter(analysis.channels)) == "imu2.y"
    assert failure.joint_of_regime["reversal"] == joint
    assert failure.regime_share["reversal"] > 0.9
    (sentence,) = analysis.sentences
    assert sentence.startswith("Gyro imu2 differs by ")
    assert "about its y axis" in sentence
    assert f"of the time in which {joint} reverses (within 50 ms)" in sentence


def test_the_numbers_of_a_sentence_are_those_of_the_data(doggy):
    comparison, recording = synthetic(doggy, on(doggy, "imu2.y", near_reversals(1)))
    prediction = comparison.sensors["imu2"]
    e = (prediction.measured - prediction.ahead)[600::10, 1]
    (sentence,) = analyse_failure(comparison, recording).sentences
    peak = np.argmax(np.abs(e))
    assert f"by {np.sqrt(np.mean(e**2)):.2g} rad/s (rms, up to {np.abs(e[peak]):.2g} at " in sentence
    assert f"allow {doggy.sensors['imu2'].sigma:.2g} rad/s" in sentence


def test_axes_of_one_sensor_that_fail_alike_share_a_sentence(doggy):
    x, z = (on(doggy, f"imu1.{axis}", near_reversals(2)) for axis in "xz")
    analysis = analyse_failure(*synthetic(doggy, lambda name, motion: x(name, motion) + z(name, motion)))
    (sentence,) = analysis.sentences
    assert "about its x and z axes" in sentence


def test_a_friction_like_error_follows_the_sign_of_a_velocity(doggy):
    error = on(doggy, "joint3.motor_position", lambda motion: 1e-3 * np.sign(motion.v[:, 2]))
    analysis = analyse_failure(*synthetic(doggy, error))
    correlations = analysis.channels["joint3.motor_position"].correlations
    assert next(iter(correlations)) == "joint3.sign(velocity)"
    assert correlations["joint3.sign(velocity)"] > 0.95
    (sentence,) = analysis.sentences
    assert sentence.startswith("The motor encoder of joint3 differs by 0.001 rad")
    assert "it follows the predicted sign of the velocity of joint3 (correlation +" in sentence


def test_a_signal_that_came_earlier_is_found_too(doggy):
    error = on(doggy, "imu1.y", lambda motion: -0.02 * np.interp(motion.times - 0.08, motion.times, motion.load[:, 1]))
    correlations = analyse_failure(*synthetic(doggy, error)).channels["imu1.y"].correlations
    assert min(correlations.values()) == correlations["joint2.load"] < -0.95


def test_the_worst_half_second_is_named(doggy):
    error = on(doggy, "imu1.x", lambda motion: 0.1 * ((motion.times > 7.0) & (motion.times < 7.4)))
    failure = analyse_failure(*synthetic(doggy, error)).channels["imu1.x"]
    assert failure.windows[0].t0 < 7.4 and failure.windows[0].t1 > 7.0
    assert failure.windows[0].share > 0.5


def test_a_comparison_that_kept_no_states_is_analysed_from_its_encoders(doggy):
    error = on(doggy, "imu2.y", near_reversals(1))
    analysis = analyse_failure(*synthetic(doggy, error, states=False))
    assert analysis.channels["imu2.y"].joint_of_regime["reversal"] == "joint2"
    assert "joint2.load" not in analysis.channels["imu2.y"].correlations
    assert len(analysis.sentences) == 1


def test_a_comparison_without_predictions_has_nothing_to_say(doggy):
    comparison, recording = synthetic(doggy)
    for prediction in comparison.sensors.values():
        prediction.ahead[:] = np.nan
    assert analyse_failure(comparison, recording).channels == {}


def test_twenty_seconds_are_analysed_in_less_than_two(doggy):
    comparison, recording = synthetic(doggy, on(doggy, "imu2.y", near_reversals(1)))
    began = time.perf_counter()
    analyse_failure(comparison, recording)
    assert time.perf_counter() - began < 2.0


def test_p_values_of_white_noise_are_uniform_also_where_its_strength_changes():
    rng = np.random.default_rng(3)
    strength = 1.0 + 9.0 * (np.sin(np.arange(800) / 40.0) > 0.8)
    p = np.array([whiteness(strength * rng.standard_normal(800)).p for _ in range(400)])
    assert 0.02 < np.mean(p < 0.05) < 0.09
    assert 0.4 < np.mean(p < 0.5) < 0.6


def test_coloured_errors_are_called_so():
    rng = np.random.default_rng(4)
    white = rng.standard_normal(800)
    coloured = white[1:] + 0.4 * white[:-1]
    assert whiteness(coloured).p < 1e-6
    assert whiteness(coloured).autocorrelation == pytest.approx(0.4 / 1.16, abs=0.08)
    assert np.isnan(whiteness(white[:20]).p)


def test_overlapping_predictions_are_thinned_to_an_even_grid():
    times = np.arange(0.0, 1.0, 0.01) + 3.0
    grid = evenly(times, times, 0.1)
    assert grid == pytest.approx(3.0 + 0.1 * np.arange(11), abs=0.011, nan_ok=True)
    with_gap = evenly(times[(times < 3.25) | (times > 3.65)], times[(times < 3.25) | (times > 3.65)], 0.1)
    assert np.isnan(with_gap[3:7]).all() and np.isfinite(with_gap[7])


def test_regimes_are_where_they_should_be(doggy):
    t = np.arange(0.0, 12.0, 0.001)
    moving = np.where(t < 4.0, 0.0, 1.0)[:, None]
    q = moving * 0.5 * np.sin(np.outer(t - 4.0, [1.0, 2.0, 3.0]))
    v = moving * 0.5 * np.array([1.0, 2.0, 3.0]) * np.cos(np.outer(t - 4.0, [1.0, 2.0, 3.0]))
    regimes = motion_regimes(doggy, JointStates(t, q, v, q / 100.0, q))
    assert regimes.masks["standstill"][:3999].all() and not regimes.masks["standstill"][4001:].any()
    reversing = t[regimes.masks["reversal"][:, 1]] - 4.0
    distance = np.abs((2.0 * reversing - np.pi / 2.0 + np.pi / 2.0) % np.pi - np.pi / 2.0) / 2.0
    assert distance.max() < 0.052
    assert regimes.masks["fast"][4000:, 2].mean() == pytest.approx(0.2, abs=0.01)
    assert regimes.masks["loaded"][4000:, 0].mean() == pytest.approx(0.2, abs=0.01)


def test_a_stop_is_no_reversal(doggy):
    t = np.arange(0.0, 3.0, 0.001)
    v = np.column_stack([np.where(t < 1.0, 1.0, np.where(t < 2.0, 0.0, -1.0))] * 3)
    assert not motion_regimes(doggy, JointStates(t, 0.0 * v, v, v, v)).masks["reversal"].any()


def test_without_springs_the_acceleration_is_the_load(doggy):
    t = np.arange(0.0, 12.0, 0.001)
    q, v = np.sin(np.outer(t, [1.0, 2.0, 3.0])), np.cos(np.outer(t, [1.0, 2.0, 3.0])) * [1.0, 2.0, 3.0]
    regimes = motion_regimes(doggy, JointStates(t, q, v, 0.0 * q, 0.0 * q))
    assert regimes.load_unit == "rad/s^2"
    assert regimes.thresholds["loaded"][1] == pytest.approx(4.0 * np.cos(0.1 * np.pi), rel=0.02)


def test_nearness_to_a_limit_comes_from_the_urdf(doggy):
    t = np.arange(0.0, 1.0, 0.001)
    lower, upper = doggy.tree.limits[1]
    q = np.zeros((len(t), 3))
    q[:, 1] = np.linspace(lower, upper, len(t))
    near = motion_regimes(doggy, JointStates(t, q, q + 1.0, q, q)).masks["near limits"]
    assert near[:, 1].mean() == pytest.approx(0.1, abs=0.005)
    assert not near[:, 0].any()


def test_an_error_in_the_motion_of_two_joints_names_both_and_one_spread_evenly_names_none():
    rng = np.random.default_rng(0)
    mask = rng.random((1000, 3)) < 0.1
    squares = 1.0 * (mask[:, 0] | mask[:, 2]) + 1e-3
    found = concentration(squares, {"reversal": mask, "fast": ~mask})
    assert (found.regime, found.joints) == ("reversal", (0, 2))
    assert found.error_share > 0.95
    assert concentration(np.ones(1000), {"reversal": mask}).regime == ""


@pytest.mark.slow
def test_a_soft_bearing_shows_in_the_gyro_behind_it(doggy_data, doggy):
    """Recordings made elsewhere; the published parameters stand for a calibration, which would take long."""
    from jointscope.graphs.comparison.compare import compare_model
    from jointscope.tools.bags.read_recording import read_recording

    published = {p.name: p.published for p in doggy.parameters.values() if p.published is not None}
    recording = read_recording(doggy_data / "bearing_flexibility" / "test.bag", doggy).between(1.0, 5.0)
    comparison = compare_model("doggy", doggy.with_values(published), recording)
    analysis = analyse_failure(comparison, recording)
    assert set(comparison.floors) == set(doggy.channels)
    assert comparison.floor == pytest.approx(np.sqrt(np.mean(np.square(list(comparison.floors.values())))))
    worst = [channel for channel in analysis.channels if channel.startswith("imu1.")][:2]
    assert set(worst) == {"imu1.x", "imu1.z"}
    assert analysis.channels["imu1.x"].whiteness_p < 1e-6
    assert any(sentence.startswith("Gyro imu1") for sentence in analysis.sentences)
