# SPDX-License-Identifier: BSD-3-Clause
"""MCAP files that rosbag2 did not write: types named in two parts, and messages that are not those of ROS 2."""

import struct

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.messages.mcap_profile import MAGIC, other_profile
from jointscope.tools.bags.messages.open_bag import open_bag

DEFINITION = "geometry_msgs/Point point\n" + 80 * "=" + "\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def record(opcode: int, content: bytes) -> bytes:
    return bytes([opcode]) + struct.pack("<Q", len(content)) + content


def written(path, profile="ros2", datatype="my_msgs/Tip", points=((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))):
    """A file without chunks and without an index, as the specification of MCAP has it."""
    parts = [record(1, text(profile) + text("a recorder"))]
    parts.append(record(3, struct.pack("<H", 1) + text(datatype) + text("ros2msg") + text(DEFINITION)))
    parts.append(record(4, struct.pack("<HH", 1, 1) + text("/tip") + text("cdr") + struct.pack("<I", 0)))
    for k, point in enumerate(points):
        times = struct.pack("<QQ", 10**9 + k, 10**9 + k)
        parts.append(record(5, struct.pack("<HI", 1, k) + times + b"\0\1\0\0" + struct.pack("<ddd", *point)))
    parts += [record(15, struct.pack("<I", 0)), record(2, struct.pack("<QQI", 0, 0, 0))]
    path.write_bytes(MAGIC + b"".join(parts) + MAGIC)
    return path


@pytest.mark.parametrize("datatype", ["my_msgs/Tip", "my_msgs/msg/Tip"])
def test_a_type_in_two_parts_is_read_as_the_one_in_three(tmp_path, datatype):
    with open_bag(written(tmp_path / "tip.mcap", datatype=datatype)) as bag:
        assert bag.type_names("/tip") == ("my_msgs/msg/Tip",)
        assert bag.message_type("/tip").name == "my_msgs/msg/Tip"
        raw = bag.read(["/tip"])["/tip"]
        points = [bag.message_type("/tip").decode(data).point for data in raw.data]
    np.testing.assert_array_equal([(p.x, p.y, p.z) for p in points], [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)])


@pytest.mark.parametrize(
    ("profile", "words"),
    [
        ("ros1", "it holds messages of ROS 1, written by a recorder; give the .bag that it was made of"),
        ("", "it holds no messages of ROS 2, it names no profile, written by a recorder; write them as ROS 2 messages"),
        ("x-drone", "it holds no messages of ROS 2, its profile is 'x-drone', written by a recorder"),
    ],
)
def test_messages_of_another_kind_are_said_and_not_called_damaged(tmp_path, profile, words):
    path = written(tmp_path / "other.mcap", profile)
    with pytest.raises(RecordingError, match="cannot read the bag") as caught, open_bag(path):
        pass
    assert words in str(caught.value)
    assert "recover" not in str(caught.value)


def test_a_damaged_header_is_left_to_the_reader(tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(written(tmp_path / "whole.mcap", "ros1").read_bytes()[:20])
    assert other_profile(path) is None
    with pytest.raises(RecordingError, match="try `mcap recover`"), open_bag(path):
        pass
