# SPDX-License-Identifier: BSD-3-Clause
"""Looks at a bag without needing to know the robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.clocks.clock_steps import on_one_clock
from jointscope.tools.bags.clocks.time_order import in_time_order
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.clocks.unfilled_stamps import without_unfilled
from jointscope.tools.bags.descriptions.bag_description import BagDescription, FieldDescription, TopicDescription
from jointscope.tools.bags.fitting_messages import left_out_notices, read_columns
from jointscope.tools.bags.messages.columns import Columns
from jointscope.tools.bags.messages.message_type import MessageType, inner_type
from jointscope.tools.bags.messages.open_bag import Bag, Progress, RawTopic, bag_sha256, open_bag, storage_files
from jointscope.tools.bags.tidying.not_finite import numbers_only
from jointscope.tools.bags.tidying.stream_notices import Timing, clipping_notices, timing

if TYPE_CHECKING:
    from jointscope.robots.model.robot import Robot

FLOATS = ("float32", "float64")
NOT_SHOWN = "covariance"
AXES = {3: ("x", "y", "z"), 4: ("x", "y", "z", "w")}


def describe_bag(path: str | Path, robot: Robot | None = None, progress: Progress | None = None) -> BagDescription:
    """Describes a bag.

    Args:
        path: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
        robot: what to compare the bag with; None to look at the bag alone.
        progress: called with the number of messages read and expected.

    Returns:
        The description. What is missing for the robot is part of it, not an error.

    Raises:
        RecordingError: the bag itself cannot be read.
    """
    path = Path(path)
    with open_bag(path) as bag:
        types = {topic: _type_with_floats(bag, topic) for topic in bag.topics}
        raw = bag.read([topic for topic, kind in types.items() if isinstance(kind, MessageType)], progress)
        topics = tuple(_topic(bag, name, types[name], raw.get(name)) for name in bag.topics)
        times = [t.received_ns for t in raw.values() if t.received]
        duration = (max(t.max() for t in times) - min(t.min() for t in times)) / 1e9 if times else 0.0
        described = BagDescription(
            path=str(path),
            sha256=bag_sha256(path),
            kind="ROS 2" if bag.ros2 else "ROS 1",
            size=sum(file.stat().st_size for file in storage_files(path)),
            duration=float(duration),
            topics=topics,
            robot=None,
            needs=(),
            usable=None,
            problem=None,
        )
        if robot is None:
            return described
        # the equations of motion behind it cost time
        from jointscope.tools.bags.descriptions.bag_for_robot import for_robot

        return for_robot(described, bag, robot)


def _type_with_floats(bag: Bag, topic: str) -> MessageType | str | None:
    """The type of a topic if it holds numbers worth describing; a text where it cannot be understood."""
    if len(bag.type_names(topic)) != 1:
        return "its messages are of more than one type"
    try:
        message_type = bag.message_type(topic)
        return message_type if _float_fields(message_type) else None
    except RecordingError as err:
        return str(err)


def _float_fields(message_type: MessageType) -> list[str]:
    """Dotted paths of the largest fields that hold nothing but floats."""
    return [
        path
        for name, kind in message_type.fields
        if name != "header"
        for path in _floats_below(message_type, kind, name)
    ]


def _floats_below(message_type: MessageType, kind: Any, path: str) -> list[str]:
    from rosbags.interfaces import Nodetype

    if NOT_SHOWN in path:
        return []
    if kind[0] == Nodetype.NAME:
        inside = message_type.fields_of(kind[1])
        below = [p for name, sub in inside for p in _floats_below(message_type, sub, f"{path}.{name}")]
        return [path] if below == [f"{path}.{name}" for name, _ in inside] and len(below) > 1 else below
    if inner_type(kind) is not None:
        return []
    primitive = kind[1][0] if kind[0] == Nodetype.BASE else kind[1][0][1][0]
    return [path] if primitive in FLOATS else []


def _topic(bag: Bag, name: str, kind: MessageType | str | None, raw: RawTopic | None) -> TopicDescription:
    msgtype = " and ".join(bag.type_names(name))
    if not isinstance(kind, MessageType) or raw is None or not raw.data:
        return TopicDescription(name, msgtype, bag.count(name), trouble=kind if isinstance(kind, str) else None)
    try:
        return _numeric_topic(name, kind, raw)
    except RecordingError as err:
        return TopicDescription(name, msgtype, len(raw.data), trouble=str(err))


def _numeric_topic(name: str, message_type: MessageType, raw: RawTopic) -> TopicDescription:
    columns = {field: read_columns(raw, message_type, field) for field in _float_fields(message_type)}
    first = max(columns.values(), key=lambda part: len(part.values) * part.values.shape[1])
    received = first.of(raw.received_ns)
    stamps = received if first.stamps is None else first.stamps
    samples, unfilled = without_unfilled(name, TimedSamples(stamps, received, first.values, first.absent))
    moved, _, steps = on_one_clock({name: samples})
    samples, notices = in_time_order(name, moved[name])
    nodes = _nodes(samples, first.names or ())
    seen = [node for _, node in nodes]
    longest = max(node.longest_gap for node in seen)
    counts = {notice.kind: notice.count for notice in notices}
    return TopicDescription(
        topic=name,
        msgtype=message_type.name,
        count=len(raw.data),
        rate=max(node.rate for node in seen),
        jitter=max(node.jitter for node in seen),
        gaps=sum(node.gaps for node in seen),
        missing=sum(node.missing for node in seen),
        longest_gap=longest,
        out_of_order=counts.get("out_of_order", 0),
        duplicates=counts.get("duplicate", 0),
        stamped=first.stamps is not None,
        names=first.names or (),
        fields=tuple(_field(field, part) for field, part in columns.items()),
        remarks=(
            *(n.text.removeprefix(f"{name}: ") for n in [*left_out_notices(name, first), *unfilled, *steps]),
            *_of_nodes(nodes),
        ),
    )


def _nodes(samples: TimedSamples, names: tuple[str, ...]) -> list[tuple[tuple[str, ...], Timing]]:
    """Joints whose samples come together, and how regular those are: one node's messages are no gaps of another's."""
    times = (samples.stamps - samples.stamps[0]) / 1e9
    if samples.filled is None or not len(names):
        return [(names, timing(times))]
    together: dict[bytes, list[int]] = {}
    for k, absent in enumerate(samples.filled.T):
        together.setdefault(absent.tobytes(), []).append(k)
    found = [(tuple(names[k] for k in some), timing(times[~samples.filled[:, some[0]]])) for some in together.values()]
    return sorted(found, key=lambda node: -node[1].rate)


def _of_nodes(nodes: Sequence[tuple[tuple[str, ...], Timing]]) -> list[str]:
    """A sentence about the rates of several nodes."""
    if len(nodes) < 2:
        return []
    listed = "; ".join(f"{', '.join(names)} at {node.rate:.2f} Hz" for names, node in nodes)
    return [f"several nodes publish on it: {listed}; rate and jitter are the largest, gaps those of each node"]


def _field(field: str, columns: Columns) -> FieldDescription:
    values = columns.values
    width = values.shape[1]
    names = columns.names or ()
    labels = names if len(names) == width else AXES.get(width, tuple(map(str, range(width))))
    finite = np.isfinite(values)
    low = np.where(finite, values, np.inf).min(axis=0)
    high = np.where(finite, values, -np.inf).max(axis=0)
    some = finite.any(axis=0)
    clipping = clipping_notices(field, numbers_only(values), labels, "1")
    return FieldDescription(
        field=field,
        columns=tuple(labels),
        minimum=tuple(np.where(some, low, np.nan).tolist()),
        maximum=tuple(np.where(some, high, np.nan).tolist()),
        not_finite=int(np.count_nonzero(~finite if columns.absent is None else ~finite & ~columns.absent)),
        clipping=tuple(notice.text for notice in clipping),
    )
