# SPDX-License-Identifier: BSD-3-Clause
"""Topics of single joints put together into one.

"/a/command + /b/command" names them. JointStates, which name their joints, are woven in the order of the bag. Of topics
with one number each, as controllers of single joints have them, arrays with one value for each are made: a value holds
until the next one of its topic. A message is made when all have come anew, or when one comes for the second time before
the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from jointscope.tools.bags.messages.message_type import MessageType

PLUS = " + "
JOINED_TYPE = "std_msgs/msg/Float64MultiArray"
WOVEN_TYPE = "sensor_msgs/msg/JointState"
SINGLE_TYPES = ("std_msgs/msg/Float64", "std_msgs/msg/Float32", JOINED_TYPE)


def parts_of(topic: str) -> tuple[str, ...]:
    """The topics behind a name; itself where it is one of a bag."""
    return tuple(topic.split(PLUS))


def joined_message_type() -> MessageType:
    """Type of the messages that are made."""
    from rosbags.typesys import Stores, get_typestore

    return MessageType(JOINED_TYPE, get_typestore(Stores.ROS2_HUMBLE), True)


@dataclass
class Joiner:
    """Makes the messages of one joined topic from those of its parts, in the order of the bag.

    Attributes:
        name: of the joined topic.
        types: of the messages of each part.
    """

    name: str
    types: Sequence[MessageType]
    _kind: MessageType = field(default_factory=joined_message_type)
    _last: int = 0

    def __post_init__(self) -> None:
        self._places = {topic: place for place, topic in enumerate(parts_of(self.name))}
        self._values = np.full(len(self._places), np.nan)
        self._fresh = np.zeros(len(self._places), bool)
        self._seen = self._fresh.copy()

    def take(self, topic: str, time: int, data: bytes) -> list[tuple[int, bytes]]:
        """What is complete with a message of a part: times [ns] and bytes; empty where more is to come."""
        place = self._places[topic]
        content = np.atleast_1d(np.asarray(self.types[place].decode(data).data, dtype=float))
        value = float(content[0]) if len(content) == 1 else np.nan
        made = []
        if self._fresh[place] and self._seen.all():
            made.append((self._last, self._message()))
        self._values[place], self._last = value, time
        self._fresh[place] = self._seen[place] = True
        if self._fresh.all():
            made.append((time, self._message()))
        return made

    def _message(self) -> bytes:
        self._fresh[:] = False
        types = self._kind.typestore.types
        layout = types["std_msgs/msg/MultiArrayLayout"]([], 0)
        return self._kind.encode(types[JOINED_TYPE](layout, self._values.copy()))
