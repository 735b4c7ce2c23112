# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses
import hashlib
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.messages.fast_columns import fast_columns
from jointscope.tools.bags.messages.open_bag import open_bag
from jointscope.tools.bags.needed_streams import needed_streams
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

SHARED = Path(__file__).resolve().parents[3].parent / "shared"
DOGGY_BAGS = (
    "clean/test",
    "clean/test/test.mcap",
    "bearing_flexibility/test.bag",
    "load_dependent_friction/test",
    "load_dependent_friction/test/test.db3",
)
BAG_NAMES = ("run.bag", "run.mcap", "run.db3", "run")
START = 1_700_000_000_123_456_789


@pytest.fixture(scope="module")
def doggy():
    return load_robot("doggy")


def some_recording(robot, n=400, seed=1):
    """Random walks at 1 kHz on a common clock; the times are whole nanoseconds."""
    rng = np.random.default_rng(seed)
    times = np.arange(n) * 1_000_000 / 1e9
    streams = {}
    for need in needed_streams(robot):
        values = np.clip(np.cumsum(rng.normal(scale=1e-2, size=(n, 3)), axis=0), -1, 1)
        received = np.rint((times + rng.uniform(1e-4, 3e-4, n)) * 1e9) / 1e9
        streams[need.name] = Stream(need.name, times, values, need.channels, "", received)
    return Recording("", "", START, streams)


def shared_bag(name):
    path = SHARED / "data" / "doggy" / name
    if not path.exists():
        pytest.skip(f"the shared recording {name} is not on this machine")
    return path


def assert_same_streams(a, b):
    assert a.start_ns == b.start_ns
    for name, stream in a.streams.items():
        assert stream.times.tobytes() == b.streams[name].times.tobytes()
        assert stream.values.tobytes() == b.streams[name].values.tobytes()
        assert stream.received.tobytes() == b.streams[name].received.tobytes()


@pytest.mark.parametrize("name", BAG_NAMES)
def test_a_recording_survives_writing_and_reading_bit_by_bit(doggy, tmp_path, name):
    recording = some_recording(doggy)
    write_bag(tmp_path / name, recording, doggy)
    assert_same_streams(recording, read_recording(tmp_path / name, doggy))


@pytest.mark.parametrize("name", BAG_NAMES)
def test_the_fast_path_equals_full_decoding_bit_by_bit(doggy, tmp_path, name):
    write_bag(tmp_path / name, some_recording(doggy), doggy)
    fast = read_recording(tmp_path / name, doggy)
    assert_same_streams(fast, read_recording(tmp_path / name, doggy, decode_all=True))


@pytest.mark.slow
@pytest.mark.parametrize("name", DOGGY_BAGS)
def test_on_the_shared_recordings_both_paths_agree_and_the_fast_one_is_taken(doggy, name):
    path = shared_bag(name)
    assert_same_streams(read_recording(path, doggy), read_recording(path, doggy, decode_all=True))
    with open_bag(path) as bag:
        for need in needed_streams(doggy):
            raw = bag.read([need.source.topic])[need.source.topic]
            assert fast_columns(raw.data, bag.message_type(raw.name), need.source.field) is not None


def test_the_hash_is_that_of_the_storage_file(doggy, tmp_path):
    write_bag(tmp_path / "run", some_recording(doggy), doggy)
    content = (tmp_path / "run" / "run.mcap").read_bytes()
    assert read_recording(tmp_path / "run", doggy).sha256 == hashlib.sha256(content).hexdigest()
    shutil.copy(tmp_path / "run" / "run.mcap", tmp_path / "bare.mcap")
    assert read_recording(tmp_path / "bare.mcap", doggy).sha256 == hashlib.sha256(content).hexdigest()


def test_a_folder_without_metadata_but_with_one_file_is_read(doggy, tmp_path):
    recording = some_recording(doggy)
    write_bag(tmp_path / "run", recording, doggy, fmt="db3")
    (tmp_path / "run" / "metadata.yaml").unlink()
    assert_same_streams(recording, read_recording(tmp_path / "run", doggy))


def test_progress_ends_with_all_messages(doggy, tmp_path):
    written, read = [], []
    write_bag(tmp_path / "run.mcap", some_recording(doggy), doggy, progress=lambda *k: written.append(k))
    read_recording(tmp_path / "run.mcap", doggy, progress=lambda *k: read.append(k))
    assert written[-1] == (1600, 1600)
    assert read[-1] == (1600, 1600)


@pytest.mark.parametrize("name", ("run.bag", "run.mcap"))
def test_units_of_the_robot_file_become_si_and_back(doggy, tmp_path, name):
    encoder = doggy.motor_encoder
    source = dataclasses.replace(encoder.source, unit="deg")
    in_degrees = doggy.with_sensors({encoder.name: dataclasses.replace(encoder, source=source)})
    recording = some_recording(doggy)
    write_bag(tmp_path / name, recording, in_degrees)
    angles = recording.streams[encoder.name].values
    as_degrees = read_recording(tmp_path / name, in_degrees).streams[encoder.name]
    as_radians = read_recording(tmp_path / name, doggy).streams[encoder.name]
    np.testing.assert_allclose(as_degrees.values, angles, rtol=1e-15)
    np.testing.assert_allclose(as_radians.values, angles * 180 / math.pi, rtol=1e-15)
    assert as_degrees.unit == "rad"


@pytest.mark.parametrize(
    "msgtype, field",
    [
        ("geometry_msgs/msg/Vector3Stamped", "vector"),
        ("geometry_msgs/WrenchStamped", "wrench.torque"),
        ("geometry_msgs/msg/TwistStamped", "twist.angular"),
        ("sensor_msgs/msg/Imu", "linear_acceleration"),
        ("sensor_msgs/msg/MagneticField", "magnetic_field"),
    ],
)
@pytest.mark.parametrize("name", ("run.bag", "run.mcap"))
def test_any_type_and_field_with_a_header_can_be_mapped(doggy, tmp_path, name, msgtype, field):
    gyro = dataclasses.replace(doggy.gyros[0], source=Topic("/other", msgtype, field, "rad/s"))
    robot = doggy.with_sensors({"imu1": gyro})
    recording = some_recording(robot)
    write_bag(tmp_path / name, recording, robot)
    assert_same_streams(recording, read_recording(tmp_path / name, robot))
    assert_same_streams(recording, read_recording(tmp_path / name, robot, decode_all=True))


def test_without_a_header_the_time_of_reception_counts_less_what_messages_take_and_is_noted(doggy, tmp_path):
    command = Topic("/duty", "std_msgs/msg/Float64MultiArray", "data", "duty", doggy.command.names)
    robot = dataclasses.replace(doggy, command=command)
    recording = some_recording(robot)
    write_bag(tmp_path / "run.mcap", recording, robot)
    read = read_recording(tmp_path / "run.mcap", robot)
    assert np.array_equal(read.command.values, recording.command.values)
    latency = min(np.median(s.received - s.times) for name, s in read.streams.items() if name != "command")
    assert np.allclose(read.command.times, read.command.received - latency, atol=2e-9)
    assert 1e-4 < latency < 3e-4
    assert [n.text for n in read.notices if n.kind == "info"] == [
        "command: the messages name no joints; the order of the robot file is assumed",
        "command: its messages carry no stamp; the time of reception stands in for it, less the "
        f"{1e6 * latency:.3g} us that other messages take; if the model does not fit, look for a delay: "
        "jointscope add ROBOT command_delay@robot -o ROBOT_command_delay.yaml",
    ]


def test_two_streams_may_share_a_topic(doggy, tmp_path):
    command = dataclasses.replace(doggy.command, topic=doggy.motor_encoder.source.topic)
    robot = dataclasses.replace(doggy, command=command)
    recording = some_recording(robot)
    same = recording.streams["motor_encoder"].received
    streams = {**recording.streams, "command": dataclasses.replace(recording.command, received=same)}
    recording = dataclasses.replace(recording, streams=streams)
    write_bag(tmp_path / "run.db3", recording, robot)
    assert_same_streams(recording, read_recording(tmp_path / "run.db3", robot))


def test_a_bag_that_cannot_be_written_leaves_nothing_behind(doggy, tmp_path, monkeypatch):
    from rosbags.rosbag2 import Writer

    def disk_full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Writer, "write", disk_full)
    target = tmp_path / "run.mcap"
    with pytest.raises(RecordingError) as error:
        write_bag(target, some_recording(doggy), doggy)
    assert str(error.value) == f"cannot write the bag {target}: No space left on device"
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_write_keeps_the_old_bag(doggy, tmp_path, monkeypatch):
    from rosbags.rosbag2 import Writer

    old = some_recording(doggy, seed=5)
    write_bag(tmp_path / "run", old, doggy)

    def interrupt(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(Writer, "write", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_bag(tmp_path / "run", some_recording(doggy), doggy)
    assert [file.name for file in tmp_path.iterdir()] == ["run"]
    assert_same_streams(old, read_recording(tmp_path / "run", doggy))


def test_a_bag_replaces_a_bag_but_not_another_folder(doggy, tmp_path):
    write_bag(tmp_path / "run", some_recording(doggy, seed=5), doggy)
    new = some_recording(doggy)
    write_bag(tmp_path / "run", new, doggy)
    assert_same_streams(new, read_recording(tmp_path / "run", doggy))
    (tmp_path / "run" / "notes.txt").write_text("precious")
    with pytest.raises(RecordingError, match="a folder of that name exists and is not a bag"):
        write_bag(tmp_path / "run", new, doggy)


@pytest.mark.parametrize("name, fmt", [("run.txt", None), ("run.bag", "mcap"), ("run", "bag")])
def test_an_unknown_format_is_refused(doggy, tmp_path, name, fmt):
    with pytest.raises(RecordingError, match=r"expected a path that ends in \.bag, \.db3 or \.mcap"):
        write_bag(tmp_path / name, some_recording(doggy), doggy, fmt=fmt)
