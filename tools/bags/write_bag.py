# SPDX-License-Identifier: BSD-3-Clause
"""Writes a Recording as a bag with the topics, types and units of a robot: whole, or not at all."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.tools.bags.load_topic import LOAD, LOAD_TYPE
from jointscope.tools.bags.messages.joined_topics import parts_of
from jointscope.tools.bags.messages.message_template import blank_message, fill_messages
from jointscope.tools.bags.messages.message_type import MessageType, known_message_type
from jointscope.tools.bags.messages.open_bag import Progress, one_line, storage_files
from jointscope.tools.bags.needed_streams import StreamSource, full_type_name, needed_streams

FORMATS = ("bag", "db3", "mcap")
PROGRESS_STEP = 10_000  # messages


@dataclass(frozen=True)
class TopicMessages:
    """All messages of one topic.

    Attributes:
        topic: its name.
        message_type: their type.
        received: time of writing of each, shape (n,) [ns].
        data: bytes of each.
    """

    topic: str
    message_type: MessageType
    received: NDArray[np.int64]
    data: list[bytes]


def write_bag(
    path: str | Path,
    recording: Recording,
    robot: Robot,
    fmt: str | None = None,
    progress: Progress | None = None,
    loads: LoadHistory | None = None,
) -> None:
    """Writes a bag.

    Args:
        path: a path that ends in .bag, .db3 or .mcap becomes one file; any other a ROS 2 folder.
        recording: the streams that `robot` needs.
        robot: says topics, types, fields, units and joint names.
        fmt: "bag", "db3" or "mcap"; by default what the suffix says, and mcap for a folder.
        progress: called with the number of messages written and to be written.
        loads: that hang on the robot, for the topic of known loads.

    Raises:
        RecordingError: the bag cannot be written; nothing is left behind.
    """
    ros2 = _format(Path(path), fmt) != "bag"
    hung = [] if loads is None else [load_topic(loads, recording.start_ns, ros2)]
    write_topics(path, [*_topics(recording, robot, ros2), *hung], fmt, progress)


def load_topic(loads: LoadHistory, start_ns: int, ros2: bool) -> TopicMessages:
    """The topic of known loads, a message for each of them."""
    kind, stamps = known_message_type(LOAD_TYPE, ros2), _nanoseconds(loads.times, start_ns)
    message, data = blank_message(kind), []
    for stamp, force, link in zip(stamps.tolist(), loads.forces.tolist(), loads.links, strict=True):
        message.header.frame_id = link
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        message.wrench.force.x, message.wrench.force.y, message.wrench.force.z = force
        data.append(kind.encode(message))
    return TopicMessages(LOAD, kind, stamps, data)


def joint_states(
    topic: str,
    names: tuple[str, ...],
    stamps: NDArray[np.int64],
    fields: dict[str, NDArray[np.float64]],
) -> TopicMessages:
    """A topic of JointStates: `fields` are positions, velocities or efforts, shape (n, c) each."""
    kind = known_message_type("sensor_msgs/msg/JointState", True)
    return TopicMessages(topic, kind, stamps, fill_messages(kind, names, stamps, fields))


def write_topics(
    path: str | Path, topics: list[TopicMessages], fmt: str | None = None, progress: Progress | None = None
) -> None:
    """Writes a bag of messages that are there already; arguments and errors as of `write_bag`."""
    path = Path(path)
    fmt = _format(path, fmt)
    if path.is_dir() and not _is_bag_folder(path):
        raise RecordingError(
            f"cannot write the bag {path}: a folder of that name exists and is not a bag; remove it or name another"
        )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
            unfinished = Path(folder) / path.name
            if fmt == "bag":
                _write_ros1(unfinished, topics, progress)
            else:
                _write_ros2(unfinished, topics, fmt, progress)
                if path.suffix:
                    unfinished = next(file for file in unfinished.iterdir() if file.suffix == f".{fmt}")
            if path.is_dir():
                os.replace(path, Path(folder) / "replaced")  # goes away with the temporary folder
            os.replace(unfinished, path)
    except RecordingError:
        raise
    except Exception as err:  # disk full comes as OSError or as an error of the database
        reason = err.strerror if isinstance(err, OSError) and err.strerror else one_line(err)
        raise RecordingError(f"cannot write the bag {path}: {reason}") from err


def _format(path: Path, fmt: str | None) -> str:
    suffix = path.suffix.removeprefix(".")
    fmt = fmt or suffix or "mcap"
    if fmt not in FORMATS or (suffix and suffix != fmt) or (fmt == "bag" and not suffix):
        raise RecordingError(
            f"cannot write the bag {path}: expected a path that ends in .bag, .db3 or .mcap, "
            f"or a folder name without suffix; got format {fmt!r}"
        )
    return fmt


def _is_bag_folder(path: Path) -> bool:
    """Whether a folder holds a ROS 2 bag and nothing else, so that replacing it loses nothing else."""
    names = {file.name for file in path.iterdir()}
    return names == {"metadata.yaml", *(file.name for file in storage_files(path))}


def _topics(recording: Recording, robot: Robot, ros2: bool) -> list[TopicMessages]:
    """The messages of every topic; streams that share a topic share its messages."""
    by_topic: dict[str, list[StreamSource]] = {}
    for need in needed_streams(robot):
        if need.name not in recording.streams:
            raise RecordingError(f"the recording has no stream {need.name!r}, which robot {robot.name!r} needs")
        if len(parts_of(need.source.topic)) > 1:
            raise RecordingError(
                f"{need.name} of robot {robot.name!r} is on one topic for each joint, which can be read and not "
                "written; name one topic with a JointState in a copy of the robot file"
            )
        by_topic.setdefault(need.source.topic, []).append(need)
    return [_messages(recording, topic, needs, ros2) for topic, needs in by_topic.items()]


def _messages(recording: Recording, topic: str, needs: list[StreamSource], ros2: bool) -> TopicMessages:
    streams = [recording.streams[need.name] for need in needs]
    first = streams[0]
    for other in streams[1:]:
        if not np.array_equal(first.times, other.times):
            raise RecordingError(f"{first.name} and {other.name} share the topic {topic} but not their times")
    source = needs[0].source
    message_type = known_message_type(full_type_name(source.msgtype), ros2)
    stamps = _nanoseconds(first.times, recording.start_ns)
    fields = {need.source.field: _in_bag_unit(need, recording.streams[need.name]) for need in needs}
    received = stamps if first.received is None else _nanoseconds(first.received, recording.start_ns)
    return TopicMessages(topic, message_type, received, fill_messages(message_type, source.names, stamps, fields))


def _in_bag_unit(need: StreamSource, stream: Stream) -> NDArray[np.float64]:
    return stream.values / need.source.factor


def _nanoseconds(times: NDArray[np.float64], start_ns: int) -> NDArray[np.int64]:
    return np.rint(times * 1e9).astype(np.int64) + start_ns


def _write_ros1(path: Path, topics: list[TopicMessages], progress: Progress | None) -> None:
    from rosbags.rosbag1 import Writer

    with Writer(path) as writer:
        _write_messages(writer, topics, progress)


def _write_ros2(folder: Path, topics: list[TopicMessages], fmt: str, progress: Progress | None) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer

    plugin = StoragePlugin.MCAP if fmt == "mcap" else StoragePlugin.SQLITE3
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        _write_messages(writer, topics, progress)


def _write_messages(writer: Any, topics: list[TopicMessages], progress: Progress | None) -> None:
    """Writes all messages in the order of their time of writing."""
    connections = [
        writer.add_connection(topic.topic, topic.message_type.name, typestore=topic.message_type.typestore)
        for topic in topics
    ]
    received = np.concatenate([topic.received for topic in topics])
    owner = np.concatenate([np.full(len(topic.data), k) for k, topic in enumerate(topics)])
    data = [message for topic in topics for message in topic.data]
    order = np.argsort(received, kind="stable")
    for done, (k, index, time) in enumerate(
        zip(owner[order].tolist(), order.tolist(), received[order].tolist(), strict=True)
    ):
        writer.write(connections[k], time, data[index])
        if progress and done % PROGRESS_STEP == 0:
            progress(done, len(data))
    if progress:
        progress(len(data), len(data))
