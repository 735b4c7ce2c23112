# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.descriptions.describe_bag import describe_bag
from jointscope.tools.bags.needed_streams import needed_streams
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

BARE = ("run.bag", "run.mcap", "run.db3")


@pytest.fixture(scope="module")
def doggy():
    return load_robot("doggy")


@pytest.fixture(scope="module")
def sound(doggy, tmp_path_factory):
    """One sound bag of each kind."""
    folder = tmp_path_factory.mktemp("sound")
    rng = np.random.default_rng(3)
    times = np.arange(500) / 1e3
    streams = {
        need.name: Stream(need.name, times, rng.uniform(-1, 1, (500, 3)), need.channels, "")
        for need in needed_streams(doggy)
    }
    for name in (*BARE, "run"):
        write_bag(folder / name, Recording("", "", 10**18, streams), doggy)
    return folder


def refused(path, robot):
    """The one-line error that reading must end with."""
    with pytest.raises(RecordingError) as error:
        read_recording(path, robot)
    text = str(error.value)
    assert "\n" not in text and str(path) in text
    return text


@pytest.mark.parametrize("name", ["x" * 5000 + ".mcap", "loop.mcap"])
def test_a_path_that_cannot_be_opened_is_one_line(doggy, tmp_path, name):
    (tmp_path / "loop.mcap").symlink_to(tmp_path / "loop.mcap")
    with pytest.raises(RecordingError) as error:
        read_recording(tmp_path / name, doggy)
    assert "\n" not in str(error.value) and len(str(error.value)) < 400


def test_a_definition_that_lacks_a_type_is_damaged(doggy, sound, tmp_path):
    content = (sound / "run.bag").read_bytes()
    broken = content.replace(b"MSG: std_msgs/Header", b"MSG: std_msgs/Hxader")
    assert broken != content
    (tmp_path / "run.bag").write_bytes(broken)
    assert "is damaged: 'std_msgs/msg/Header'" in refused(tmp_path / "run.bag", doggy)


@pytest.mark.parametrize("name", (*BARE, "run"))
def test_a_missing_bag_is_said_to_be_missing(doggy, tmp_path, name):
    path = tmp_path / name
    assert refused(path, doggy) == (
        f"the bag {path} does not exist; expected a .bag, a .mcap, a .db3 or a ROS 2 bag folder"
    )


@pytest.mark.parametrize("name", BARE)
def test_an_empty_file_is_said_to_be_empty(doggy, tmp_path, name):
    (tmp_path / name).touch()
    assert refused(tmp_path / name, doggy) == f"the bag {tmp_path / name} is empty (0 bytes); record it again"


def test_a_file_of_another_kind_is_refused(doggy, tmp_path):
    (tmp_path / "run.csv").write_text("t, q")
    assert refused(tmp_path / "run.csv", doggy) == (
        f"{tmp_path / 'run.csv'} is not a bag: unknown suffix '.csv'; expected .bag, .mcap, .db3 or a ROS 2 bag folder"
    )


def test_a_folder_that_is_no_bag_is_refused(doggy, tmp_path):
    assert refused(tmp_path, doggy) == (
        f"the folder {tmp_path} is not a ROS 2 bag: it has no metadata.yaml and 0 storage files; "
        "give one of its files, or run `ros2 bag reindex`"
    )


@pytest.mark.parametrize("name", BARE)
def test_rubbish_is_refused_with_advice(doggy, tmp_path, name):
    (tmp_path / name).write_bytes(np.random.default_rng(0).bytes(5000))
    text = refused(tmp_path / name, doggy)
    assert text.startswith(f"cannot read the bag {tmp_path / name}: ")
    assert text.endswith("or record it again")


@pytest.mark.parametrize("share", (0.02, 0.3, 0.6, 0.95, 0.999))
@pytest.mark.parametrize("name", BARE)
def test_a_truncated_bag_is_refused(doggy, sound, tmp_path, name, share):
    content = (sound / name).read_bytes()
    (tmp_path / name).write_bytes(content[: int(share * len(content))])
    text = refused(tmp_path / name, doggy)
    assert text.endswith("or record it again")


@pytest.mark.parametrize("name", BARE)
def test_a_hole_in_the_middle_is_found(doggy, sound, tmp_path, name):
    content = bytearray((sound / name).read_bytes())
    middle = len(content) // 2
    content[middle : middle + 8192] = b"\xff" * 8192
    (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, doggy)


@pytest.mark.parametrize("name", BARE)
@pytest.mark.parametrize("seed", range(12))
def test_whatever_is_broken_the_error_is_one_of_ours(doggy, sound, tmp_path, name, seed):
    rng = np.random.default_rng(seed)
    content = bytearray((sound / name).read_bytes())
    for position in rng.integers(0, len(content), size=int(rng.choice([1, 10, 100]))):
        content[position] = rng.integers(256)
    (tmp_path / name).write_bytes(content)
    for look in (read_recording, describe_bag):
        try:
            look(tmp_path / name, doggy)
        except RecordingError as err:
            assert "\n" not in str(err)


def test_fewer_messages_than_the_metadata_promise_is_a_truncated_bag(doggy, sound, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "run.mcap").write_bytes((sound / "run" / "run.mcap").read_bytes())
    metadata = (sound / "run" / "metadata.yaml").read_text().replace("message_count: 500", "message_count: 501")
    (folder / "metadata.yaml").write_text(metadata)
    assert refused(folder, doggy) == (
        f"{folder} is truncated: topic /imu1/data_raw holds 500 messages, expected 501; "
        "try `ros2 bag reindex`, or record it again"
    )


def test_broken_metadata_are_named(doggy, sound, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "run.mcap").write_bytes((sound / "run" / "run.mcap").read_bytes())
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 9")
    assert refused(folder, doggy).startswith(f"cannot read the bag {folder}: Could not load YAML")
