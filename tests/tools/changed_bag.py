# SPDX-License-Identifier: BSD-3-Clause
"""A bag whose messages are those of another one, changed one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore


def changed_bag(source: Path, path: Path, change: Callable[[str, Any, int], Iterable[tuple[str, Any]]]) -> Path:
    """Writes a bag as a bare .mcap.

    Args:
        source: the bag that is changed.
        path: folder of the new one.
        change: gives topics and messages for a topic, a message and its place in the bag; messages may be changed.
    """
    store, connections = get_typestore(Stores.ROS2_HUMBLE), {}
    with AnyReader([source]) as reader, Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for k, (connection, time, data) in enumerate(reader.messages()):
            for topic, message in change(connection.topic, reader.deserialize(data, connection.msgtype), k):
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=store)
                writer.write(connections[topic], time, store.serialize_cdr(message, kind))
    return next(path.glob("*.mcap"))
