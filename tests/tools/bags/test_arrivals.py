# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.arrivals import Arrivals
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.needed_streams import needed_streams
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

START = 1_700_000_000_000_000_000


def disordered_recording(robot, n=300, seed=4):
    """Samples up to 5 ms late, some twice, some not a number."""
    rng = np.random.default_rng(seed)
    streams = {}
    for need in needed_streams(robot):
        times = np.arange(n) * 1_000_000 / 1e9
        values = rng.uniform(-0.5, 0.5, (n, 3))
        received = np.rint((times + rng.uniform(1e-4, 5e-3, n)) * 1e9) / 1e9
        if need.name == "imu1":
            values[50:60] = np.nan
        if need.name == "motor_encoder":
            times, values, received = np.r_[times, times[7]], np.vstack([values, values[7]]), np.r_[received, 0.2]
        streams[need.name] = Stream(need.name, times, values, need.channels, "", received)
    return Recording("", "", START, streams)


def messages(blocks):
    return [
        (name, float(stamp), float(received), values.tolist())
        for block in blocks
        for received, name, stamp, values in block
    ]


def expected_messages(recording):
    found = []
    for name, s in recording.streams.items():
        found += [(name, float(t), float(r), v.tolist()) for t, r, v in zip(s.times, s.received, s.values, strict=True)]
    return found


@pytest.mark.parametrize("name", ("run.bag", "run.mcap", "run.db3", "run"))
def test_every_message_comes_once_in_the_order_of_reception(doggy, tmp_path, name):
    recording = disordered_recording(doggy)
    write_bag(tmp_path / name, recording, doggy)
    found = messages(ArrivalReader(tmp_path / name, doggy))
    received = [message[2] for message in found]
    assert received == sorted(received)
    assert sorted(map(repr, found)) == sorted(map(repr, expected_messages(recording)))


def test_small_blocks_are_the_same_messages(doggy, tmp_path):
    write_bag(tmp_path / "run.mcap", disordered_recording(doggy), doggy)
    small = ArrivalReader(tmp_path / "run.mcap", doggy, block=37)
    whole = ArrivalReader(tmp_path / "run.mcap", doggy)
    assert list(map(repr, messages(small))) == list(map(repr, messages(whole)))
    assert small.start_ns == whole.start_ns == START
    assert small.messages == whole.messages == 1201


def test_what_a_recording_loses_is_there(doggy, tmp_path):
    write_bag(tmp_path / "run.mcap", disordered_recording(doggy), doggy)
    encoder = [m for m in messages(ArrivalReader(tmp_path / "run.mcap", doggy)) if m[0] == "motor_encoder"]
    stamps = np.array([stamp for _, stamp, _, _ in encoder])
    assert np.count_nonzero(stamps == 0.007) == 2
    assert np.any(np.diff(stamps) < 0.0)
    recording = read_recording(tmp_path / "run.mcap", doggy)
    assert np.all(np.diff(recording.streams["motor_encoder"].times) > 0.0)
    assert len(recording.streams["motor_encoder"]) == len(stamps) - 1
    assert ArrivalReader(tmp_path / "run.mcap", doggy).seconds_later(recording) == -START / 1e9  # nothing was read yet


def test_a_recording_in_memory_arrives_sensors_first(doggy):
    recording = disordered_recording(doggy)
    tied = {name: Stream(name, s.times[:5], s.values[:5], s.channels, s.unit) for name, s in recording.streams.items()}
    order = [name for _, name, _, _ in Arrivals.of(Recording("", "", START, tied))]
    assert order[:4] == ["motor_encoder", "imu1", "imu2", "command"]
    assert order == 5 * order[:4]


def test_a_cut_bag_is_one_line(doggy, tmp_path):
    write_bag(tmp_path / "run.mcap", disordered_recording(doggy), doggy)
    whole = (tmp_path / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RecordingError, match=r"cut\.mcap"):
        messages(ArrivalReader(tmp_path / "cut.mcap", doggy))


def test_a_missing_topic_is_one_line(doggy, tmp_path):
    write_bag(tmp_path / "run.mcap", disordered_recording(doggy), doggy)
    gyro = doggy.sensors["imu1"]
    moved = dataclasses.replace(gyro, source=dataclasses.replace(gyro.source, topic="/imu7/data_raw"))
    with pytest.raises(RecordingError, match=r"topic /imu7/data_raw is missing"):
        messages(ArrivalReader(tmp_path / "run.mcap", doggy.with_sensors({"imu1": moved})))
