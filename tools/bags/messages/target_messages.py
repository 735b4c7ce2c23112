# SPDX-License-Identifier: BSD-3-Clause
"""The messages about one target: a tracker may tell of all targets on one topic, and `child_frame_id` says which."""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.yaml_section import did_you_mean
from jointscope.tools.bags.messages.fast_columns import fast_columns
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.messages.open_bag import RawTopic

CHILD = "child_frame_id"


def target_messages(
    sensor: str, names: tuple[str, ...], topic: RawTopic, message_type: MessageType, field: str, some: bool = False
) -> NDArray[np.intp] | None:
    """Which messages of a topic tell of one target in the axes of one tracker.

    Args:
        sensor: where the target is in the robot file, as "sensors.tip".
        names: its `child_frame_id`; empty where the robot file gives none.
        topic: all messages.
        message_type: their type.
        field: dotted path of the position.
        some: whether these are some of the messages, among which there may be none about it.

    Returns:
        Their places; None where they are all.

    Raises:
        RecordingError: none tells of it, several targets are told of and none was chosen, or several trackers.
    """
    if not names and (not message_type.has_header or fast_columns(topic.data, message_type, field) is not None):
        return None  # all texts are the same
    frames = [_frames(data, message_type) for data in topic.data]
    children = Counter(frame.target for frame in frames if frame is not None)
    if names and names[0] not in children and not some:
        known = [child for child in children if child]
        raise RecordingError(
            f"topic {topic.name}: no message has the {CHILD} {names[0]!r} of {sensor}.names"
            f"{did_you_mean(names[0], known)}"
        )
    if not names and len(children) > 1:
        raise RecordingError(
            f"topic {topic.name} tells of several targets ({CHILD} {_listed(children)}); name the one of "
            f"{sensor} in the robot file, for example `names: [{next(filter(None, children))}]`"
        )
    own = [k for k, frame in enumerate(frames) if not names or (frame is not None and frame.target == names[0])]
    trackers = Counter(frame.tracker for k in own if (frame := frames[k]) is not None)
    if len(trackers) > 1:
        name = sensor.rpartition(".")[2]
        raise RecordingError(
            f"topic {topic.name}: the positions of {name} are in the axes of several trackers (header.frame_id "
            f"{_listed(trackers)}); expected one: give each a topic and a sensor of its own, or transform the positions"
        )
    return np.array(own, dtype=np.intp)


class _Frames(NamedTuple):
    """What a message says whose position it holds, and in whose axes; empty where its type has no room for it."""

    tracker: str
    target: str


def _frames(data: bytes, message_type: MessageType) -> _Frames | None:
    """The frames of a message; None of a damaged one, which the reader counts."""
    try:
        message: Any = message_type.decode(data)
    except RecordingError:
        return None
    return _Frames(str(message.header.frame_id) if message_type.has_header else "", str(getattr(message, CHILD, "")))


def _listed(counts: Counter[str]) -> str:
    return ", ".join(f"{name or 'none'} {count} times" for name, count in counts.most_common(5))
