# SPDX-License-Identifier: BSD-3-Clause
"""The streams that a robot needs of a bag: their topics, their columns and their units."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Sensor, Topic
from jointscope.robots.recordings.recording import Notice
from jointscope.robots.recordings.wrapped_counter import continued
from jointscope.robots.yaml_section import did_you_mean
from jointscope.tools.bags.messages.columns import Columns
from jointscope.tools.bags.messages.field_path import field_path
from jointscope.tools.bags.messages.joined_topics import parts_of
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.messages.open_bag import Bag, RawTopic
from jointscope.tools.bags.messages.target_messages import target_messages


@dataclass(frozen=True)
class StreamSource:
    """A stream that a robot needs.

    Attributes:
        name: "command" or the sensor's name.
        source: where it is in the bag.
        channels: name of each column.
        of_target: whether it is the position of a target, which a tracker may lose.
        section: of the robot file that names it.
    """

    name: str
    source: Topic
    channels: tuple[str, ...]
    of_target: bool = False
    section: str = "sensors"


def needed_streams(robot: Robot) -> list[StreamSource]:
    """All streams a robot needs, the command first.

    Raises:
        RobotError: the robot file describes poses alone.
    """
    robot.need_motion()
    command = StreamSource("command", robot.command, tuple(f"{joint}.command" for joint in robot.joints))
    return [command, *(_of_sensor(sensor) for sensor in robot.sensors.values())]


def _of_sensor(sensor: Sensor) -> StreamSource:
    return StreamSource(sensor.name, sensor.source, sensor.channels, isinstance(sensor, PositionTarget))


def check_same_streams(robots: Mapping[str, Robot]) -> None:
    """All models must be about the same measurements.

    Args:
        robots: by their labels.

    Raises:
        RobotError: two robots read other topics, fields or units.
    """
    if len({robot.free_links for robot in robots.values()}) > 1:
        raise RobotError(
            f"{', '.join(robots)}: some have link_dynamics: free, some a model of their links; compare those alike"
        )
    (first, reference), *others = ((label, needed_streams(robot)) for label, robot in robots.items())
    for label, needed in others:
        if needed != reference:
            odd = next((b.name for a, b in zip(reference, needed, strict=False) if a != b), "the number of its sensors")
            raise RobotError(
                f"{first} and {label} cannot be compared on one recording: they differ in {odd} (topic, type, field, "
                "unit or names)"
            )


def check_topic(bag: Bag, source: Topic) -> MessageType:
    """Checks that a bag has a topic with messages of the right type, and the field in it.

    Raises:
        RecordingError: it does not; the message says what is there instead.
    """
    place = f"{bag.path}: topic {source.topic}"
    if not bag.holds(source.topic):
        gone = next(part for part in parts_of(source.topic) if part not in bag.topics)
        place, hint = f"{bag.path}: topic {gone}", did_you_mean(gone, bag.topics)
        raise RecordingError(f"{place} is missing; record it, or change `topic` in the robot file{hint}")
    types = bag.type_names(source.topic)
    if types != (full_type_name(source.msgtype),):
        raise RecordingError(
            f"{place} holds {' and '.join(types)}; the robot file expects {full_type_name(source.msgtype)}"
        )
    if bag.count(source.topic) == 0:
        raise RecordingError(f"{place} is empty: it holds no message; check that its driver ran while recording")
    message_type = bag.message_type(source.topic)
    field_path(message_type, source.field, source.topic)
    return message_type


def full_type_name(name: str) -> str:
    """The ROS 2 spelling of a message type: "sensor_msgs/Imu" is "sensor_msgs/msg/Imu"."""
    package, _, rest = name.partition("/")
    return name if "/" in rest else f"{package}/msg/{rest}"


def own_messages(
    need: StreamSource, topic: RawTopic, message_type: MessageType, some: bool = False
) -> NDArray[np.intp] | None:
    """Which messages of a topic, or of a block of it, are about a stream; None for all.

    Raises:
        RecordingError: a tracker tells of several targets and nothing says which, or there are several trackers.
    """
    if not need.of_target:
        return None
    return target_messages(
        f"{need.section}.{need.name}", need.source.names, topic, message_type, need.source.field, some
    )


def in_si(source: Topic, values: NDArray[np.float64], before: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Samples in SI units, counters continued, each joint with its own factor.

    Args:
        source: where they come from.
        values: as they stand in the bag, shape (n, m).
        before: what the last sample before them became, shape (m,); None for the first ones.
    """
    factor = source.factor
    if not source.wraps:
        return values * factor
    return continued(values, source.wraps, None if before is None else before / factor) * factor


def wanted_of(need: StreamSource) -> tuple[tuple[str, ...], int | None]:
    """Names that a message must have, and number of values of one without names."""
    names = () if need.of_target else need.source.names  # the names of a target chose the messages
    by_place = bool(names) and all(name.isdecimal() for name in names)
    return ((), None) if by_place else (names, len(need.channels))


def column_order(
    need: StreamSource, columns: Columns, known: Container[str] = ()
) -> tuple[NDArray[np.intp], list[Notice]]:
    """Which column of the message belongs to which channel; joints that are `known` otherwise are not ignored."""
    place = f"topic {need.source.topic}, field {need.source.field!r}"
    width, wanted = columns.values.shape[1], () if need.of_target else need.source.names
    names = columns.names or ()
    if wanted and not names and all(name.isdecimal() for name in wanted):
        return _by_place(need, width), []
    if not wanted or not names:
        if width != len(need.channels):
            raise RecordingError(
                f"{place}: {need.name} expects {len(need.channels)} values ({', '.join(need.channels)}), got {width}"
            )
        text = f"{need.name}: the messages name no joints; the order of the robot file is assumed"
        unchecked = wanted and not names and width > 1
        return np.arange(width), [Notice(need.name, "info", 0, text)] if unchecked else []
    if width != len(names):
        raise RecordingError(f"{place}: {width} values for {len(names)} joint names ({', '.join(names)})")
    missing = [name for name in wanted if name not in names]
    if missing:
        raise RecordingError(
            f"{place}: no joint {missing[0]!r} in the messages, which name {', '.join(names)}; "
            f"set `names` of {need.name} in the robot file"
        )
    _refuse_repeated(names, place)
    extra = [name for name in names if name not in wanted and name not in known]
    text = f"{need.name}: joints of the bag that the robot does not have are ignored: {', '.join(extra)}"
    notices = [Notice(need.name, "info", len(extra), text)] if extra else []
    return np.array([names.index(name) for name in wanted]), notices


def _by_place(need: StreamSource, width: int) -> NDArray[np.intp]:
    """Columns of messages without names, where the robot file counts their places from 0."""
    order = np.array([int(name) for name in need.source.names])
    if order.max() >= width:
        raise RecordingError(
            f"topic {need.source.topic}, field {need.source.field!r}: {width} values, `names` of {need.name} asks for "
            f"place {order.max()}; expected 0 to {width - 1}"
        )
    return order


def _refuse_repeated(names: Sequence[str], place: str) -> None:
    repeated = [name for name in names if names.count(name) > 1]
    if repeated:
        raise RecordingError(f"{place}: the joint name {repeated[0]!r} stands {names.count(repeated[0])} times")
