# SPDX-License-Identifier: BSD-3-Clause
"""Topics with one number each become one with a number for each."""

from __future__ import annotations

import numpy as np

from jointscope.tools.bags.messages.joined_topics import Joiner, joined_message_type
from jointscope.tools.bags.messages.message_type import MessageType

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
