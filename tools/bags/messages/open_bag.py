# SPDX-License-Identifier: BSD-3-Clause
"""Opens a bag of any kind and hands out the raw bytes of its topics; every failure becomes one sentence."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.messages.joined_topics import (
    JOINED_TYPE,
    SINGLE_TYPES,
    Joiner,
    joined_message_type,
    parts_of,
)
from jointscope.tools.bags.messages.mcap_profile import other_profile
from jointscope.tools.bags.messages.message_type import MessageType, defined_message_type, full_type_name, inner_type

Progress = Callable[[int, int], None]

BAG_SUFFIXES = (".bag", ".mcap", ".db3")  # of files that are bags by themselves
STORAGE_SUFFIXES = (".mcap", ".db3", ".zstd")
REPAIR = {
    ".bag": "try `rosbag reindex`, or record it again",
    ".mcap": "try `mcap recover`, or record it again",
    ".db3": "try `sqlite3 BAG .recover`, or record it again",
    "": "try `ros2 bag reindex`, or record it again",
}
PROGRESS_STEP = 10_000  # messages


@dataclass
class RawTopic:
    """The messages of one topic, in the order of the bag.

    Attributes:
        name: the topic.
        received: time of writing of each message [ns].
        data: bytes of each message.
    """

    name: str
    received: list[int] = field(default_factory=list)
    data: list[bytes] = field(default_factory=list)

    @property
    def received_ns(self) -> NDArray[np.int64]:
        """Time of writing, shape (n,) [ns]."""
        return np.array(self.received, dtype=np.int64)

    def take(self, rows: NDArray[np.intp] | None) -> RawTopic:
        """The messages at some places; all where these are None."""
        if rows is None:
            return self
        return RawTopic(self.name, [self.received[k] for k in rows], [self.data[k] for k in rows])


class Bag:
    """An open bag.

    Attributes:
        path: where it lies.
        ros2: False for a ROS 1 bag.
    """

    def __init__(self, path: Path, reader: Any, ros2: bool):
        self.path = path
        self.ros2 = ros2
        self._reader = reader
        self._infos = dict(reader.topics)

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of all topics."""
        return tuple(self._infos)

    def holds(self, topic: str) -> bool:
        """Whether a topic, or each of those that are joined in it, is there."""
        return all(part in self._infos for part in parts_of(topic))

    def count(self, topic: str) -> int:
        """Number of messages that the bag promises for a topic; of joined ones of all of them, 0 if one has none."""
        counts = [int(self._infos[part].msgcount) for part in parts_of(topic)]
        return sum(counts) if all(counts) else 0

    def type_names(self, topic: str) -> tuple[str, ...]:
        """Message types on a topic; more than one only in odd bags."""
        parts = parts_of(topic)
        if len(parts) > 1:
            kinds = {kind for part in parts for kind in self.type_names(part)}
            return (JOINED_TYPE,) if kinds <= set(SINGLE_TYPES) else tuple(sorted(kinds))
        return tuple(sorted({full_type_name(link.msgtype, self.ros2) for link in self._infos[topic].connections}))

    def message_type(self, topic: str) -> MessageType:
        """The type of a topic's messages.

        Raises:
            RecordingError: the definition in the bag cannot be understood.
        """
        if self.type_names(topic) == (JOINED_TYPE,) and len(parts_of(topic)) > 1:
            return joined_message_type()
        connection = self._infos[parts_of(topic)[0]].connections[0]
        try:
            name = full_type_name(connection.msgtype, self.ros2)
            found = defined_message_type(name, connection.msgdef, self.ros2)
            _look_up(found, found.name, set())
            return found
        except RecordingError as err:
            raise RecordingError(f"{self.path}, topic {topic}: {err}") from err
        except Exception as err:  # the parser of definitions leaks errors of many kinds
            raise RecordingError(
                f"{self.path}, topic {topic}: the definition of {connection.msgtype} is damaged: {one_line(err)}"
            ) from err

    def messages(self, topics: Sequence[str], progress: Progress | None = None) -> Iterator[tuple[str, int, bytes]]:
        """All messages of some topics, joined ones, too, one by one in the order of the bag.

        Args:
            topics: their names.
            progress: called with the number of messages read and expected.

        Yields:
            Topic, time of writing [ns] and bytes.

        Raises:
            RecordingError: the bag is damaged or holds fewer messages than it promises.
        """
        several = [topic for topic in topics if len(parts_of(topic)) > 1]
        woven = [topic for topic in several if self.type_names(topic) != (JOINED_TYPE,)]  # their messages name joints
        joiners = [Joiner(t, [self.message_type(p) for p in parts_of(t)]) for t in several if t not in woven]
        found = dict.fromkeys((part for topic in topics for part in parts_of(topic)), 0)
        connections = [connection for topic in found for connection in self._infos[topic].connections]
        expected, k = sum(self.count(topic) for topic in found), 0
        try:
            # without connections the reader would deliver everything
            for connection, time, data in self._reader.messages(connections=connections) if connections else ():
                if not isinstance(time, int) or isinstance(data, str | int | float | None):
                    raise TypeError("a message without time or content")  # a damaged database gives None
                found[connection.topic] += 1
                k += 1
                if progress and k % PROGRESS_STEP == 0:
                    progress(k, expected)
                if connection.topic in topics:
                    yield connection.topic, time, data
                yield from ((topic, time, data) for topic in woven if connection.topic in parts_of(topic))
                for joiner in joiners:
                    if connection.topic in parts_of(joiner.name):
                        yield from ((joiner.name, *made) for made in joiner.take(connection.topic, time, data))
        except Exception as err:  # damaged bags raise errors of every kind
            raise RecordingError(
                f"{self.path} is damaged after {k} of {expected} messages: {one_line(err)}; {repair(self.path)}"
            ) from err
        for topic, count in found.items():
            if count < self.count(topic):
                raise RecordingError(
                    f"{self.path} is truncated: topic {topic} holds {count} messages, "
                    f"expected {self.count(topic)}; {repair(self.path)}"
                )
        if progress:
            progress(k, max(expected, k))

    def read(self, topics: Sequence[str], progress: Progress | None = None) -> dict[str, RawTopic]:
        """All messages of some topics, by topic.

        Args:
            topics: their names.
            progress: called with the number of messages read and expected.

        Raises:
            RecordingError: the bag is damaged or holds fewer messages than it promises.
        """
        found = {topic: RawTopic(topic) for topic in topics}
        for topic, time, data in self.messages(topics, progress):
            raw = found[topic]
            raw.received.append(time)
            raw.data.append(data)
        return found


@contextmanager
def open_bag(path: str | Path) -> Iterator[Bag]:
    """Opens a bag for reading.

    Args:
        path: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.

    Raises:
        RecordingError: there is no such bag, or it cannot be read.
    """
    path = Path(path)
    reader, ros2 = _reader(_storage(path), path)
    try:
        try:
            reader.open()
            bag = Bag(path, reader, ros2)
        except Exception as err:  # damaged bags raise errors of every kind
            why = other_profile(_storage(path)) or f"{one_line(err)}; {repair(path)}"
            raise RecordingError(f"cannot read the bag {path}: {why}") from err
        yield bag
    finally:
        with suppress(Exception):
            reader.close()


def bag_sha256(path: str | Path) -> str:
    """Hash of a bag's content; for a folder of its storage files in the order of their names."""
    digest = hashlib.sha256()
    for file in storage_files(Path(path)):
        with file.open("rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def storage_files(path: Path) -> list[Path]:
    """The files with the messages."""
    if not path.is_dir():
        return [path]
    return sorted(file for file in path.iterdir() if file.suffix in STORAGE_SUFFIXES)


def repair(path: Path) -> str:
    """What to do about a damaged bag."""
    return REPAIR.get(path.suffix, REPAIR[""])


def one_line(err: BaseException) -> str:
    """An error as part of a sentence."""
    text = " ".join(str(err).split()) or type(err).__name__
    return (text if len(text) <= 160 else text[:157] + "...").rstrip(".")


def _look_up(message_type: MessageType, name: str, seen: set[str]) -> None:
    """Looks up all types inside one; a damaged definition lacks some."""
    seen.add(name)
    for _, kind in message_type.fields_of(name):
        inside = inner_type(kind)
        if inside is not None and inside not in seen:
            _look_up(message_type, inside, seen)


def _storage(path: Path) -> Path:
    """What to open: the path itself, or the only storage file of a folder without metadata."""
    try:
        is_there = path.exists()
    except OSError as err:  # a name that no file can have, a folder that must not be entered
        raise RecordingError(f"cannot read the bag {str(path)[:160]}: {err.strerror or one_line(err)}") from err
    if not is_there:
        raise RecordingError(f"the bag {path} does not exist; expected a .bag, a .mcap, a .db3 or a ROS 2 bag folder")
    if not path.is_dir() or (path / "metadata.yaml").exists():
        return path
    files = storage_files(path)
    if len(files) != 1:
        raise RecordingError(
            f"the folder {path} is not a ROS 2 bag: it has no metadata.yaml and {len(files)} storage files; "
            "give one of its files, or run `ros2 bag reindex`"
        )
    return files[0]


def _reader(storage: Path, path: Path) -> tuple[Any, bool]:
    if storage.is_file() and storage.suffix not in BAG_SUFFIXES:
        raise RecordingError(
            f"{path} is not a bag: unknown suffix {storage.suffix!r}; expected .bag, .mcap, .db3 or a ROS 2 bag folder"
        )
    try:
        if storage.stat().st_size == 0:
            raise RecordingError(f"the bag {path} is empty (0 bytes); record it again")
        if storage.suffix == ".bag":
            from rosbags import rosbag1

            return rosbag1.Reader(storage), False
        from rosbags import rosbag2

        return rosbag2.Reader(storage), True
    except OSError as err:
        raise RecordingError(f"cannot read the bag {path}: {one_line(err)}") from err
