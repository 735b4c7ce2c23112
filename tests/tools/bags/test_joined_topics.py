# SPDX-License-Identifier: BSD-3-Clause
"""Topics and messages of single joints become those of all joints."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from changed_bag import changed_bag

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.fitting_messages import fitting_messages
from jointscope.tools.bags.messages.columns import Columns
from jointscope.tools.bags.messages.joined_topics import Joiner, joined_message_type
from jointscope.tools.bags.messages.message_parts import MessageParts
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
NOTHING = {"velocity": np.zeros(0), "effort": np.zeros(0)}

KIND = joined_message_type()
SINGLE = MessageType("std_msgs/msg/Float64", KIND.typestore, True)


def joined(messages):
    """Times and values of what is made of (topic, time, value)."""
    joiner = Joiner("/a + /b", [SINGLE, SINGLE])
    made = []
    for topic, time, value in messages:
        data = SINGLE.encode(SINGLE.typestore.types["std_msgs/msg/Float64"](float(value)))
        made += [(t, *KIND.decode(raw).data.tolist()) for t, raw in joiner.take(topic, time, data)]
    return made


def test_a_round_of_all_topics_is_one_message_at_its_end():
    assert joined([("/a", 0, 1), ("/b", 1, 2), ("/b", 10, 3), ("/a", 11, 4)]) == [(1, 1, 2), (11, 4, 3)]


def test_a_value_holds_until_the_next_one_of_its_topic():
    got = joined([("/a", 0, 1), ("/b", 1, 2), ("/a", 10, 5), ("/a", 20, 6), ("/b", 21, 7)])
    assert got == [(1, 1, 2), (10, 5, 2), (21, 6, 7)]


def test_nothing_is_made_before_all_topics_have_spoken():
    assert joined([("/a", k, k) for k in range(5)]) == []
    assert joined([("/a", 0, 1), ("/a", 5, 2), ("/b", 6, 3)]) == [(6, 2, 3)]


def test_an_array_of_one_is_a_number_and_another_one_is_none():
    joiner = Joiner("/a + /b", [KIND, KIND])
    layout = KIND.typestore.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    array = KIND.typestore.types["std_msgs/msg/Float64MultiArray"]
    joiner.take("/a", 0, KIND.encode(array(layout, np.array([1.5]))))
    ((_, raw),) = joiner.take("/b", 1, KIND.encode(array(layout, np.array([1.0, 2.0]))))
    values = KIND.decode(raw).data
    assert values[0] == 1.5 and np.isnan(values[1])


def columns(name, times, values, first):
    stamps = np.round(1e9 * np.asarray(times)).astype(np.int64)
    return Columns(stamps, np.asarray(values)[:, None], (name,), first + 2 * np.arange(len(stamps)))


def test_joints_with_messages_of_their_own_are_read_at_their_own_stamps():
    a, b = np.arange(0.0, 2.0, 0.01), np.arange(0.0042, 1.99, 0.0101)
    b = b[(b < 0.7) | (b > 0.8)]
    parts = MessageParts("/t", "position", (columns("a", a, np.sin(3 * a), 0), columns("b", b, np.cos(4 * b), 1)), 0)
    found = fitting_messages(parts, ("b", "a"))
    assert found.names == ("b", "a") and not found.left_out
    times = found.stamps / 1e9
    told = np.isfinite(found.values)
    np.testing.assert_allclose(np.sort(times[told[:, 1]]), a, atol=1e-12)
    np.testing.assert_allclose(found.values[told[:, 1], 1], np.sin(3 * times[told[:, 1]]), atol=1e-8)
    np.testing.assert_allclose(found.values[told[:, 0], 0], np.cos(4 * times[told[:, 0]]), atol=1e-8)
    np.testing.assert_array_equal(found.absent, ~told)  # a node that was silent for a while is no other case


def test_messages_of_two_nodes_with_one_stamp_are_one_row_and_those_of_one_node_stay_apart():
    t = np.repeat(np.arange(20) / 10, [1] * 5 + [2] + [1] * 14)
    parts = (columns("a", t, np.arange(21.0), 0), columns("b", np.arange(20) / 10, -np.arange(20.0), 1))
    found = fitting_messages(MessageParts("/t", "position", parts, 0))
    assert found.names == ("a", "b") and len(found.values) == 21
    assert found.values[5].tolist() == [5.0, -5.0] and found.values[6, 0] == 6.0 and found.absent[6].tolist() == [0, 1]
    assert np.count_nonzero(found.absent) == 1


def test_joints_of_messages_without_stamps_are_rows_in_the_order_of_the_bag():
    parts = [columns("a", np.zeros(9), np.arange(9.0), 0), columns("b", np.zeros(8), -np.arange(8.0), 1)]
    for stamps in (parts, [replace(part, stamps=None) for part in parts]):
        found = fitting_messages(MessageParts("/t", "position", tuple(stamps), 0), ("a", "b"))
        assert found.rows.tolist() == list(range(17))
        assert np.isnan(found.values[::2, 1]).all() and found.values[1::2, 1].tolist() == (-np.arange(8.0)).tolist()


@pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")
@pytest.mark.parametrize("topic", ["/{}/joint_states", "/joint_states"])
def test_an_arm_whose_joints_have_topics_or_messages_of_their_own_is_the_same_arm(tmp_path, topic):
    def by_joint(name, message, k):
        if name != "/joint_states":
            yield name, message
            return
        for j, joint in enumerate(message.name):
            yield topic.format(joint), replace(message, name=[joint], position=message.position[j : j + 1], **NOTHING)

    bag = changed_bag(CASES / "arm_viscous.mcap", tmp_path / "split", by_joint)
    apart = tmp_path / "apart.yaml"
    whole = tmp_path / "whole.yaml"
    urdf = str(CASES / "arm_viscous.urdf")
    assert main(["init", urdf, str(CASES / "arm_viscous.mcap"), "-o", str(whole)]) == 0
    if topic != "/joint_states":
        assert main(["init", urdf, str(bag), "-o", str(apart)]) == 0
        assert "/shoulder/joint_states + /elbow/joint_states + /wrist/joint_states" in apart.read_text()
    else:
        apart.write_text(whole.read_text())
    expected = read_recording(CASES / "arm_viscous.mcap", load_robot(whole)).streams["motor_encoder"]
    found = read_recording(bag, load_robot(apart)).streams["motor_encoder"]
    assert found.values.tobytes() == expected.values.tobytes() and found.times.tobytes() == expected.times.tobytes()
    (block,) = list(ArrivalReader(bag, load_robot(apart)))
    assert len(block) == 2 * len(expected)
