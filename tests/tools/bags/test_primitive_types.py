# SPDX-License-Identifier: BSD-3-Clause
"""Both ways to read a number agree for every type that ROS has: as views of the bytes, and by full decoding."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from jointscope.tools.bags.messages.message_parts import message_parts
from jointscope.tools.bags.messages.message_type import NUMPY_TYPES, MessageType
from jointscope.tools.bags.messages.open_bag import RawTopic


def message_type(text, ros2):
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE if ros2 else Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(text, "a/msg/B"))
    return MessageType("a/msg/B", store, ros2)


def raw_messages(primitive, form, ros2, count=5):
    """Messages whose bytes run through all values, behind the header and the length that the form asks for."""
    size, number = np.dtype(NUMPY_TYPES[primitive]).itemsize, 1 if form == "{}" else 3
    head = b"\0\1\0\0" if ros2 else b""
    if form == "{}[]":
        head += struct.pack("<I", number) + b"\0\0\0\0" * (ros2 and size == 8)
    modulus = 2 if primitive == "bool" else 256
    data = [bytes((37 * i + 50 * k + 199) % modulus for i in range(size * number)) for k in range(count)]
    return RawTopic("/t", list(range(count)), [head + body + b"\7" for body in data])


@pytest.mark.parametrize("ros2", (False, True), ids=("ROS 1", "ROS 2"))
@pytest.mark.parametrize("form", ("{}", "{}[3]", "{}[]"))
@pytest.mark.parametrize("primitive", NUMPY_TYPES)
def test_both_paths_read_the_same_number(primitive, form, ros2):
    kind = message_type(f"{form.format(primitive)} x\nuint8 tail\n", ros2)
    raw = raw_messages(primitive, form, ros2)
    (fast,) = message_parts(raw, kind, "x").parts
    (slow,) = message_parts(raw, kind, "x", decode_all=True).parts
    assert fast.rows is None  # the fast path was taken
    assert fast.values.tobytes() == slow.values.tobytes()


@pytest.mark.parametrize(("ros2", "expected"), [(False, -56.0), (True, 200.0)])
@pytest.mark.parametrize("decode_all", (False, True))
def test_a_byte_is_signed_in_ros_1_and_unsigned_in_ros_2(ros2, expected, decode_all):
    kind = message_type("byte x\n", ros2)
    raw = RawTopic("/t", [0], [b"\0\1\0\0" * ros2 + b"\xc8"])
    assert message_parts(raw, kind, "x", decode_all).parts[0].values.tolist() == [[expected]]


@pytest.mark.parametrize("ros2", (False, True), ids=("ROS 1", "ROS 2"))
@pytest.mark.parametrize("field", ("when", "span"))
def test_times_and_durations_are_their_two_numbers(ros2, field):
    text = "builtin_interfaces/Time when\nbuiltin_interfaces/Duration span\n" if ros2 else "time when\nduration span\n"
    kind = message_type(text, ros2)
    raw = RawTopic("/t", [0], [b"\0\1\0\0" * ros2 + struct.pack("<iIiI", 5, 7, -3, 9)])
    expected = {"when": [[5.0, 7.0]], "span": [[-3.0, 9.0]]}[field]
    for decode_all in (False, True):
        assert message_parts(raw, kind, field, decode_all).parts[0].values.tolist() == expected
