# SPDX-License-Identifier: BSD-3-Clause
"""Joints of one message that were sampled at different instants."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.clocks.own_stamps import at_message_stamps
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

STEP = 10_000_000  # [ns]


def angle(t):
    """Where a joint is, with accelerations up to 8 rad/s^2."""
    return 0.5 * np.sin(4.0 * t)


def skewed(n=400, seed=2, spread=4e6):
    """Stamps of messages, and of a drive that was asked some milliseconds before or after [ns]."""
    rng = np.random.default_rng(seed)
    stamps = 1_700_000_000_000_000_000 + STEP * np.arange(n, dtype=np.int64)
    return stamps, stamps + rng.normal(0.0, spread, n).astype(np.int64)


def seconds(stamps):
    return (stamps - stamps[0]) / 1e9


def test_a_joint_stands_where_it_was_at_the_stamp_of_the_message():
    stamps, own = skewed()
    start = stamps[0]
    truth = angle(seconds(stamps))
    logged = np.column_stack([truth, angle((own - start) / 1e9)])
    values, (notice,) = at_message_stamps("motor_encoder", ["message", "imu2"], stamps, logged, {"imu2": own})
    assert np.array_equal(values[:, 0], truth)
    assert np.std(logged[:, 1] - truth) > 5e-3
    assert np.abs(values[2:-2, 1] - truth[2:-2]).max() < 8.0 / 8.0 * 0.03**2  # a chord over at most 30 ms
    assert "imu2 4 ms" in notice.text


def test_stamps_that_overtake_each_other_do_no_harm():
    stamps, own = skewed()
    own = own.copy()
    own[100], own[101] = own[101], own[100]
    logged = angle((own - stamps[0]) / 1e9)[:, None]
    values, _ = at_message_stamps("link_encoder", ["imu2"], stamps, logged, {"imu2": own})
    assert np.abs(values[2:-2, 0] - angle(seconds(stamps))[2:-2]).max() < 2e-3


@pytest.mark.parametrize(
    ("own", "said"),
    [
        (lambda stamps: None, "its messages carry no stamp"),
        (lambda stamps: stamps[1:], "400 messages, but 399 of imu2; expected one for one"),
        (lambda stamps: stamps + 3_000_000_000, "its stamps are 3 s from those of the messages"),
    ],
)
def test_stamps_that_cannot_be_those_of_the_joint_are_refused(own, said):
    stamps, _ = skewed()
    with pytest.raises(RecordingError, match=said):
        at_message_stamps("motor_encoder", ["imu2"], stamps, np.zeros((400, 1)), {"imu2": own(stamps)})


@pytest.fixture
def robot(doggy):
    """A Doggy whose second joint is sampled with its first gyro."""
    source = dataclasses.replace(doggy.motor_encoder.source, stamped_by=("message", "imu1", "message"))
    return doggy.with_sensors({"motor_encoder": dataclasses.replace(doggy.motor_encoder, source=source)})


def test_a_bag_is_read_with_the_stamps_of_the_joints(robot, tmp_path):
    stamps, own = skewed(spread=1e6)
    times, sampled = seconds(stamps), (own - stamps[0]) / 1e9
    positions = np.column_stack([angle(times), angle(sampled), angle(times)])
    streams = {
        "command": Stream("command", times, np.zeros((400, 3)), ("1", "2", "3"), "1"),
        "motor_encoder": Stream("motor_encoder", times, positions, robot.motor_encoder.channels, "rad"),
        "imu1": Stream("imu1", sampled, np.zeros((400, 3)), ("x", "y", "z"), "rad/s"),
        "imu2": Stream("imu2", times, np.zeros((400, 3)), ("x", "y", "z"), "rad/s"),
    }
    write_bag(tmp_path / "run.mcap", Recording("", "", int(stamps[0]), streams), robot)
    recording = read_recording(tmp_path / "run.mcap", robot)
    encoder = recording.streams["motor_encoder"]
    at = encoder.times + recording.start_ns / 1e9 - stamps[0] / 1e9
    assert np.abs(encoder.values - angle(at)[:, None])[3:-3].max() < 2e-4
    assert any("by the stamps of imu1" in notice.text for notice in recording.notices)


def test_a_replay_says_that_it_cannot(robot, tmp_path):
    with pytest.raises(RobotError, match=r"motor_encoder\.stamped_by: a replay feeds messages as they come"):
        ArrivalReader(tmp_path / "run.mcap", robot)


def test_commands_are_not_interpolated(doggy, tmp_path):
    text = doggy.path.read_text(encoding="utf-8").replace(
        "  topic: /motor_command\n", "  topic: /motor_command\n  stamped_by: [message, imu1, message]\n", 1
    )
    (tmp_path / "robot.yaml").write_text(text.replace("urdf: ", f"urdf: {doggy.path.parent}/"), encoding="utf-8")
    with pytest.raises(RobotError, match=r"command\.stamped_by: expected only at encoders and torques"):
        load_robot(tmp_path / "robot.yaml")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("[message, imu1]", "expected a sensor, or 'message', for each of the 3 joints, got 2"),
        ("[message, imu7, message]", "expected 'message' or a sensor with stamps of its own, got 'imu7'"),
        ("[message, motor_encoder, message]", "a sensor with stamps of its own, got 'motor_encoder'"),
    ],
)
def test_robot_files_with_impossible_stamps_are_refused(doggy, tmp_path, line, said):
    text = doggy.path.read_text(encoding="utf-8").replace(
        "    kind: motor_encoder\n", f"    kind: motor_encoder\n    stamped_by: {line}\n"
    )
    text = text.replace("urdf: ", f"urdf: {doggy.path.parent}/")
    (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(RobotError) as caught:
        load_robot(tmp_path / "robot.yaml")
    assert said in str(caught.value)
