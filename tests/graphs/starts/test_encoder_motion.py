# SPDX-License-Identifier: BSD-3-Clause
"""Velocities from coarse and from slow encoders, damping of states at bends, and means of measured drives."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.problem.timeline import Timeline
from jointscope.graphs.solving.state_damping import FACTOR, FIRST, LARGEST, MOST_TRIES, StateDamping
from jointscope.graphs.starts.encoder_motion import encoder_motion, hides_reversals
from jointscope.robots.parts.sensors import MotorEncoder, Topic
from jointscope.robots.recordings.recording import Recording, Stream

SOURCE = Topic("/js", "sensor_msgs/msg/JointState", "position", "rad")


def encoder(sigma):
    return MotorEncoder("enc", SOURCE, np.array([sigma]), np.zeros(1), ("swing",))


def sampled(rate, noise, seconds=4.0):
    times = np.arange(int(seconds * rate)) / rate
    rng = np.random.default_rng(3)
    values = 0.4 * np.sin(5.0 * times) + noise * rng.standard_normal(len(times))
    return Stream("enc", times, values[:, None], ("swing",), "rad")


@pytest.mark.parametrize(
    ("rate", "noise", "allowed"), [(100.0, 4e-4, 0.05), (1000.0, 2e-3, 0.08), (50.0, 1e-7, 0.02), (1000.0, 3e-5, 0.02)]
)
def test_velocities_are_right_whatever_the_encoder(rate, noise, allowed):
    stream = sampled(rate, noise)
    ticks = np.arange(0.1, 3.8, 2e-3)
    q, v = encoder_motion(stream, encoder(noise), ticks)
    assert np.std(v[:, 0] - 2.0 * np.cos(5.0 * ticks)) < allowed
    assert np.std(q[:, 0] - 0.4 * np.sin(5.0 * ticks)) < max(noise, 2e-4)


def test_only_coarse_encoders_hide_when_a_joint_turns_over():
    assert hides_reversals(sampled(1000.0, 0.0), encoder(4e-4))
    assert not hides_reversals(sampled(1000.0, 0.0), encoder(7e-5))
    assert not hides_reversals(sampled(100.0, 0.0), encoder(3e-5))


def test_only_the_states_whose_cost_rises_are_damped():
    damping = StateDamping.of([np.arange(1000) * 2.5e-3])
    before, there = np.zeros(1000), np.full(1000, -0.1)
    there[500] = 50.0
    assert damping.raised([before], [there])
    (values,) = damping.values
    assert values[500] == FIRST and np.all(values[:400] == 0.0) and np.all(values[600:] == 0.0)
    assert damping.raised([before], [there])
    assert values[500] == pytest.approx(FACTOR * FIRST)
    damping.relaxed()
    assert damping.values[0][500] == pytest.approx(FIRST)


def test_a_step_that_is_bad_everywhere_is_no_matter_of_some_states():
    damping = StateDamping.of([np.arange(1000) * 2.5e-3])
    assert not damping.raised([np.zeros(1000)], [np.ones(1000)])
    assert not damping.raised([np.zeros(1000)], [np.full(1000, np.nan)])
    assert np.all(damping.values[0] == 0.0)


def test_damping_of_states_ends():
    damping = StateDamping.of([np.arange(1000) * 2.5e-3])
    there = np.zeros(1000)
    there[500] = 1.0
    for _ in range(3):
        tries = 0
        while damping.raised([np.zeros(1000)], [there]):
            tries += 1
            assert tries <= MOST_TRIES
        damping.tries = 0
    assert damping.values[0][500] >= LARGEST


def test_a_measured_drive_has_its_mean_in_every_step():
    times = np.array([0.0, 0.01, 0.02, 0.03])
    drive = Stream("command", times, np.array([[0.0], [1.0], [0.0], [3.0]]), ("swing",), "A")
    seen = Stream("enc", np.linspace(0.0, 0.035, 36), np.zeros((36, 1)), ("swing",), "rad")
    recording = Recording("x", "", 0, {"command": drive, "enc": seen})
    held, measured = Timeline.of(recording), Timeline.of(recording, held=False)
    np.testing.assert_array_equal(held.ticks, measured.ticks)
    inside = measured.ticks[:-1] < 0.03 - 1e-9
    assert measured.u[0, 0] == pytest.approx(0.5 * measured.h[0] / 0.01)
    np.testing.assert_allclose(measured.u[~inside, 0], 3.0)


def test_the_mean_of_a_fast_drive_that_was_measured_is_that_of_the_signal_not_of_its_chords():
    w, period = 2.0 * np.pi * 6.0, 0.01
    times = np.delete(period * np.arange(100), np.arange(60, 70))  # some are missing
    drive = Stream("command", times, np.sin(w * times)[:, None], ("swing",), "A")
    seen = Stream("enc", np.linspace(0.0, 0.99, 991), np.zeros((991, 1)), ("swing",), "rad")
    found = Timeline.of(Recording("x", "", 0, {"command": drive, "enc": seen}), held=False)
    true = -np.diff(np.cos(w * found.ticks)) / w / found.h
    middle = 0.5 * (found.ticks[1:] + found.ticks[:-1])
    plain = ((middle > 0.01) & (middle < 0.58)) | ((middle > 0.72) & (middle < 0.97))
    wrong = np.abs(found.u[:, 0] - true)
    assert wrong[plain].max() < 0.008  # chords: 0.0175
    whole = (found.ticks[:-1] > 0.00999) & (found.ticks[1:] < 0.51001)  # three periods whose chords would be too small
    scale = float(found.u[whole, 0] @ np.sin(w * middle[whole]) / (true[whole] @ np.sin(w * middle[whole])))
    assert abs(scale - 1.0) < 1e-3  # chords: 0.988
    gap = (middle > 0.59) & (middle < 0.70)
    chord = np.interp(middle[gap], times, drive.values[:, 0])
    np.testing.assert_allclose(found.u[gap, 0], chord, atol=1e-9)
