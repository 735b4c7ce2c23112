# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.recordings.resting_joints import joints_without_motion, must_move
from jointscope.robots.recordings.screening import _check_limits, screen
from jointscope.tools.bags.read_recording import read_recording

SHARED = Path(__file__).resolve().parents[3].parent / "shared"
SHARED_BAGS = (
    "clean/train",
    "clean/test",
    "bearing_flexibility/train.bag",
    "bearing_flexibility/test.bag",
    "load_dependent_friction/train",
    "load_dependent_friction/test",
    "backlash/train",
    "backlash/test",
)
ENCODER = "motor_encoder"


@pytest.fixture(scope="module")
def doggy():
    return load_robot("doggy")


@pytest.fixture(scope="module")
def good(doggy):
    """Two seconds of smooth motion of a stiff Doggy, with the noise and biases of its robot file."""
    rng = np.random.default_rng(4)
    times = np.arange(2000) / 1e3
    omega, phase = 2 * np.pi * np.array([0.7, 1.1, 1.6]), np.array([0.0, 1.0, 2.0])
    angle = omega * times[:, None] + phase
    q, v = 0.4 * np.sin(angle), 0.4 * omega * np.cos(angle)
    streams = {
        "command": Stream("command", times, 0.8 * np.cos(angle), tuple(f"{j}.command" for j in doggy.joints), "1"),
        ENCODER: Stream(ENCODER, times, q + rng.normal(scale=7e-5, size=q.shape), doggy.motor_encoder.channels, "rad"),
    }
    for gyro in doggy.gyros:
        rate = doggy.tree.body_rate(gyro.body, q, v)[0] @ gyro.R_imu_body.T + gyro.bias
        rate += rng.normal(scale=gyro.sigma, size=rate.shape)
        streams[gyro.name] = Stream(gyro.name, times, rate, gyro.channels, "rad/s")
    return Recording("", "", 0, streams)


def changed(recording, name, change):
    """The recording with one stream's values changed by a function."""
    stream = recording.streams[name]
    stream = dataclasses.replace(stream, values=change(stream.values.copy()))
    return dataclasses.replace(recording, streams={**recording.streams, name: stream})


def cut(recording, name, t0, t1):
    streams = {**recording.streams, name: recording.streams[name].between(t0, t1)}
    return dataclasses.replace(recording, streams=streams)


def error_of(recording, robot, check=screen):
    with pytest.raises(RecordingError) as error:
        check(recording, robot)
    assert "\n" not in str(error.value)
    return str(error.value)


def texts(recording, robot):
    return [notice.text for notice in screen(recording, robot)]


def test_a_good_recording_passes_without_a_word(doggy, good):
    assert screen(good, doggy) == []


@pytest.mark.parametrize("name", SHARED_BAGS)
def test_the_shared_recordings_and_their_moving_slices_pass(doggy, name):
    path = SHARED / "data" / "doggy" / name
    if not path.exists():
        pytest.skip(f"the shared recording {name} is not on this machine")
    recording = read_recording(path, doggy)
    assert texts(recording, doggy) == []
    for start in np.arange(0.0, recording.duration - 3.9, 1.0):
        slow_to_start = [text for text in texts(recording.between(start, start + 4.0), doggy) if "not move" not in text]
        assert slow_to_start == []


def test_an_empty_stream_is_refused(doggy, good):
    assert error_of(cut(good, "imu2", 50, 60), doggy) == "imu2 is empty: it holds no sample"


@pytest.mark.parametrize("value", (np.nan, np.inf, -np.inf))
def test_values_that_are_not_finite_are_refused_with_count_and_time(doggy, good, value):
    def spoil(values):
        values[[300, 400, 401], 1] = value
        return values

    assert error_of(changed(good, "imu1", spoil), doggy) == (
        "imu1.y holds 3 values that are not finite (NaN or infinite), the first at 0.300 s; "
        "expected a number in every sample: check the field, or remove those messages"
    )


def test_a_dead_gyro_axis_is_refused(doggy, good):
    def spoil(values):
        values[:, 2] = 0.25
        return values

    assert error_of(changed(good, "imu2", spoil), doggy) == (
        "imu2.z never changes: 0.25 rad/s in all 2000 samples; expected at least noise: "
        "the sensor is dead or another field holds its values"
    )


def test_a_dead_encoder_of_a_driven_joint_is_refused(doggy, good):
    def spoil(values):
        values[:, 0] = 0.0
        return values

    assert error_of(changed(good, ENCODER, spoil), doggy).startswith(
        "joint1.motor_position never changes: 0 rad in all 2000 samples;"
    )


def test_a_short_recording_is_refused(doggy, good):
    assert error_of(good.between(0, 0.25), doggy) == "the recording is too short: 0.249 s; expected at least 0.3 s"
    few = dataclasses.replace(good, streams={k: s.between(0, 0.05) for k, s in good.streams.items()})
    assert error_of(few, doggy) == "motor_encoder is too short: 50 samples; expected at least 100"


def test_streams_that_do_not_overlap_are_refused(doggy, good):
    late = dataclasses.replace(good.streams["imu1"], times=good.streams["imu1"].times + 100.0)
    recording = dataclasses.replace(good, streams={**good.streams, "imu1": late})
    assert error_of(recording, doggy) == (
        "command ends at 1.999 s, before imu1 begins at 100.000 s; expected streams of the same stretch of time: "
        "check that both are stamped by the same clock"
    )


def test_a_stream_that_begins_late_is_noted(doggy, good):
    assert texts(cut(good, "imu1", 0.5, 2.0), doggy) == [
        "all streams together cover only 1.499 of 1.999 s: imu1 begins late or command ends early"
    ]


def test_a_joint_at_rest_is_noted_with_the_parameters_it_hides(doggy, good):
    rng = np.random.default_rng(6)

    def rest(values):
        values[:, 1] = rng.normal(scale=7e-5, size=len(values))
        return values

    resting = changed(good, ENCODER, rest)
    expected = (
        "joint2 does not move in this recording, so it cannot tell "
        "joint2.coulomb_torque, joint2.stiffness, joint2.damping"
    )
    assert joints_without_motion(resting, doggy) == ("joint2",)
    assert expected in texts(resting, doggy)
    said = error_of(resting, doggy, lambda recording, robot: must_move(robot, [recording]))
    assert "joint2 never moves, so joint2.coulomb_torque, joint2.stiffness, joint2.damping cannot be found" in said
    assert "add a recording that moves joint2 to this one, or lock it where it stands" in said
    assert "--joints joint1,joint3 -o doggy_locked.yaml" in said


def test_no_parameter_is_asked_for_that_the_robot_does_not_have(doggy, good):
    resting = changed(good, ENCODER, lambda values: np.where(np.arange(3) == 1, 0.4, values))
    rigid = {name: p for name, p in doggy.parameters.items() if name not in ("joint2.stiffness", "joint2.damping")}
    robot = dataclasses.replace(doggy, parameters=rigid)
    with pytest.raises(RecordingError, match=r"so joint2.coulomb_torque cannot be found.*`locked: {joint2: 0.4}`"):
        must_move(robot, [resting])


def test_a_joint_that_rests_in_one_recording_may_move_in_another(doggy, good):
    resting = changed(good, ENCODER, lambda values: np.where(np.arange(3) == 1, 0.4, values))
    must_move(doggy, [resting, good])
    with pytest.raises(RecordingError, match="joint2 never moves"):
        must_move(doggy, [resting])


def test_a_joint_whose_values_are_known_may_rest(doggy, good):
    resting = changed(good, ENCODER, lambda values: np.where(np.arange(3) == 1, 0.4, values))
    known = {
        name: dataclasses.replace(p, fixed=p.fixed or name.startswith("joint2."))
        for name, p in doggy.parameters.items()
    }
    must_move(dataclasses.replace(doggy, parameters=known), [resting])


def test_a_recording_without_any_motion_is_refused(doggy, good):
    rng = np.random.default_rng(6)
    resting = changed(good, ENCODER, lambda values: rng.normal(scale=7e-5, size=values.shape))
    assert error_of(resting, doggy) == (
        "no joint moves in this recording; expected motion: nothing can be learned from rest"
    )


def test_a_command_of_zero_is_refused(doggy, good):
    assert error_of(changed(good, "command", np.zeros_like), doggy) == (
        "the command is zero in all samples; expected a robot that is driven: check the topic"
    )


def test_a_duty_cycle_in_percent_is_recognized(doggy, good):
    text = error_of(changed(good, "command", lambda values: 100 * values), doggy)
    assert text.endswith("expected a duty cycle from -1 to 1; it looks like percent: divide by 100")


def test_a_duty_cycle_beyond_one_is_refused(doggy, good):
    text = error_of(changed(good, "command", lambda values: 1.5 * values), doggy)
    assert text.endswith("reaches 1.2; expected a duty cycle from -1 to 1; check `command.unit`")


def test_a_voltage_beyond_the_supply_is_refused(doggy, good):
    robot = dataclasses.replace(doggy, command=dataclasses.replace(doggy.command, unit="V"))
    text = error_of(changed(good, "command", lambda values: 100 * values), robot)
    assert text.endswith("reaches 80 V; the supply gives 32 V; check `command.unit` or `motor.supply_voltage`")


@pytest.mark.parametrize("seconds", (0.5, 2.0))
def test_angles_in_degrees_are_recognized_by_the_limits(doggy, good, seconds):
    text = error_of(changed(good, ENCODER, np.degrees).between(0, seconds), doggy)
    assert text.endswith(
        "the angles look like degrees: set `unit` of sensors.motor_encoder in the robot file (now rad) to deg"
    )


def test_one_joint_that_is_too_fast_among_others_that_are_not_is_no_matter_of_their_unit(doggy):
    v = np.tile(0.5 * doggy.tree.velocity_limits, (9, 1))
    v[4, 2] *= 20.0
    with pytest.raises(RecordingError, match=r"joint3.motor_position moves at .*; all other joints keep") as error:
        _check_limits(SimpleNamespace(q=np.zeros((9, 3)), v=v), doggy)
    assert "--joints joint1,joint2 -o" in str(error.value) and "look like" not in str(error.value)


def test_small_angles_in_degrees_are_recognized_by_the_gyros(doggy, good):
    small = good
    for name in (ENCODER, "imu1", "imu2"):
        small = changed(small, name, lambda values: 0.04 * values)
    text = error_of(changed(small, ENCODER, np.degrees), doggy)
    assert text == (
        "imu1 turns 0.0175 times as fast as the encoders say that link1 does; the encoders look like deg: "
        "set `unit` of sensors.motor_encoder in the robot file (now rad) to deg"
    )


@pytest.mark.parametrize("unit, factor", [("deg/s", 180 / np.pi), ("rpm", 30 / np.pi)])
@pytest.mark.parametrize("name", ("imu1", "imu2"))
def test_a_gyro_in_another_unit_is_recognized(doggy, good, name, unit, factor):
    text = error_of(changed(good, name, lambda values: factor * values), doggy)
    assert text.startswith(f"{name} turns {factor:.3g} times as fast as the encoders say that ")
    assert text.endswith(
        f"its values look like {unit}: set `unit` of sensors.{name} in the robot file (now rad/s) to {unit}"
    )


def test_a_gyro_that_is_converted_once_too_often_is_recognized(doggy, good):
    assert error_of(changed(good, "imu2", np.radians), doggy) == (
        "imu2 turns 0.0175 times as fast as the encoders say that link3 does; "
        "that is the factor between degrees and radians: check what its driver publishes"
    )


def test_a_gyro_on_another_robot_is_noted(doggy, good):
    rng = np.random.default_rng(8)
    noise = changed(good, "imu2", lambda values: rng.normal(scale=100.0, size=values.shape))
    (text,) = texts(noise, doggy)
    assert text.startswith("imu2 turns ") and text.endswith("check its unit, its body and its topic")


@pytest.mark.parametrize(
    "change, wrong",
    [
        (lambda w: w[:, [1, 0, 2]], "its x looks like +y; its y looks like +x"),
        (lambda w: w * [1, -1, 1], "its y looks like -y"),
        (lambda w: -w[:, [0, 2, 1]], "its x looks like -x; its y looks like -z; its z looks like -y"),
    ],
)
def test_swapped_and_flipped_gyro_axes_are_noted(doggy, good, change, wrong):
    (text,) = texts(changed(good, "imu2", change), doggy)
    assert text.startswith(f"imu2: the axes seem swapped or flipped against R_imu_body: {wrong}; as it stands ")


def test_angles_somewhat_beyond_the_limits_are_only_noted(doggy, good):
    wide = changed(good, ENCODER, lambda values: 5.0 * values)
    for name in ("imu1", "imu2"):
        wide = changed(wide, name, lambda values: 5.0 * values)
    assert any("doggy.urdf allows 3.142 rad" in text for text in texts(wide, doggy))
