# SPDX-License-Identifier: BSD-3-Clause
"""Wrong gear ratios and scales of gyros are named before anything else is made of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.robots.recordings.encoder_gyro_scale import check_scales, slopes_of
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.recordings.screening import screen

ENCODER = "motor_encoder"


@pytest.fixture(scope="module")
def good(doggy):
    """Twelve seconds of slow motion of a Doggy with springs of 0.2 s^2, with noise and biases."""
    rng = np.random.default_rng(4)
    times = np.arange(12000) / 1e3
    omega, phase = 2 * np.pi * np.array([[0.13, 0.31], [0.19, 0.29], [0.17, 0.37]]), rng.uniform(0, 6, (3, 2))
    angle = omega * times[:, None, None] + phase
    q, v = (0.4 * np.sin(angle)).sum(axis=2), (0.4 * omega * np.cos(angle)).sum(axis=2)
    stretched = 1.0 + 0.02 * omega**2  # a link on its spring moves further than its motor
    q_link = (0.4 * stretched * np.sin(angle)).sum(axis=2)
    v_link = (0.4 * stretched * omega * np.cos(angle)).sum(axis=2)
    streams = {
        "command": Stream("command", times, 0.5 * v, tuple(f"{j}.command" for j in doggy.joints), "1"),
        ENCODER: Stream(ENCODER, times, q + rng.normal(scale=7e-5, size=q.shape), doggy.motor_encoder.channels, "rad"),
    }
    for gyro in doggy.gyros:
        rate = doggy.tree.body_rate(gyro.body, q_link, v_link)[0] @ gyro.R_imu_body.T + gyro.bias
        rate += rng.normal(scale=gyro.sigma, size=rate.shape)
        streams[gyro.name] = Stream(gyro.name, times, rate, gyro.channels, "rad/s")
    return Recording("", "", 0, streams)


def scaled(recording, name, factor):
    stream = recording.streams[name]
    stream = replace(stream, values=stream.values * factor)
    return replace(recording, streams={**recording.streams, name: stream})


def texts(recording, robot):
    return [notice.text for notice in check_scales(recording, robot)]


def test_a_good_recording_passes_without_a_word(doggy, good):
    assert texts(good, doggy) == []
    assert screen(good, doggy) == []


def test_slopes_are_one_although_the_links_move_further_than_the_motors(doggy, good):
    """The springs alone would make them 1.05."""
    for gyro in doggy.gyros:
        for slope in slopes_of(good, doggy, gyro):
            assert slope.value == pytest.approx(1.0, abs=min(3.0 * slope.sigma, 0.04)), slope


def test_a_wrong_gear_ratio_of_one_joint_is_told_from_the_scale_of_a_gyro(doggy, good):
    (text,) = texts(scaled(good, ENCODER, np.array([1.2, 1.0, 1.0])), doggy)
    assert text.startswith("joint1 turns 0.83")
    assert text.endswith("by imu2): check the gear ratio and the unit of the encoder of joint1")


def test_the_scale_of_one_gyro_is_told_from_a_wrong_gear_ratio(doggy, good):
    (text,) = texts(scaled(good, "imu1", 1.2), doggy)
    assert text.startswith("joint1 turns 1.20")
    assert text.endswith("by imu2): check the scale of imu1")


def test_with_one_gyro_alone_both_explanations_are_given(doggy, good):
    robot = replace(doggy, sensors={name: sensor for name, sensor in doggy.sensors.items() if name != "imu2"})
    (text,) = texts(scaled(good, ENCODER, np.array([0.8, 1.0, 1.0])), robot)
    assert text.startswith("joint1 turns 1.2")
    assert text.endswith(
        " times as far by imu1 as by its motor encoder: check the gear ratio and the unit of the encoder of joint1, "
        "and the scale of imu1"
    )


def test_the_notice_comes_with_the_screening(doggy, good):
    notices = [n for n in screen(scaled(good, ENCODER, 1.1), doggy) if n.text.startswith("joint1 turns 0.9")]
    assert [(n.stream, n.kind) for n in notices] == [(ENCODER, "unit")]


def test_a_gyro_whose_axes_are_swapped_is_not_asked_about_scales(doggy, good):
    stream = good.streams["imu2"]
    swapped = replace(stream, values=stream.values[:, [2, 1, 0]])
    notices = screen(replace(good, streams={**good.streams, "imu2": swapped}), doggy)
    assert [n.kind for n in notices] == ["mirrored"]
    assert notices[0].text.startswith(
        "imu2: the axes seem swapped or flipped against R_imu_body: its x looks like +z; its z looks like +x; "
    )


def test_a_short_recording_tells_nothing(doggy, good):
    assert texts(scaled(good, ENCODER, 1.2).between(0.0, 5.0), doggy) == []


def test_a_wrong_gear_of_a_simulated_elastic_robot_is_named(doggy):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    mistake = "wrong_gear@robot:factor=1.1"
    recording = simulate(doggy, "calibration", 8.0, seed=5, friction="smooth", effects=[mistake]).recording
    (text,) = [n.text for n in screen(recording, doggy)]
    assert text.startswith("joint1 turns 0.90")
    assert text.endswith("by imu2): check the gear ratio and the unit of the encoder of joint1")


def test_a_clean_simulated_recording_passes(simulated, doggy):
    assert screen(simulated.recording, doggy) == []
