# SPDX-License-Identifier: BSD-3-Clause
"""Many messages from one: a message is serialized once, then stamps and numbers are put into copies of its bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.messages.byte_layout import byte_layout
from jointscope.tools.bags.messages.columns import STAMP
from jointscope.tools.bags.messages.field_path import field_path
from jointscope.tools.bags.messages.message_type import NUMPY_TYPES, MessageType, is_list_of_texts


def fill_messages(
    message_type: MessageType,
    names: tuple[str, ...],
    stamps: NDArray[np.int64],
    fields: dict[str, NDArray[np.float64]],
) -> list[bytes]:
    """The bytes of many messages of one type.

    Args:
        message_type: the type.
        names: joint names, for types that have a field `name`.
        stamps: time of measurement of each message, shape (n,) [ns].
        fields: numbers by dotted field, each of shape (n, m), in the unit of the bag.

    Returns:
        n messages.

    Raises:
        RecordingError: the type has no such field or no room for m numbers there.
    """
    for field in fields:
        field_path(message_type, field, "to write")
    lengths = {field: values.shape[1] for field, values in fields.items()}
    template = message_type.encode(_blank(message_type, message_type.name, "", lengths, names))
    layout = byte_layout(template, message_type)
    if layout is None:
        raise RecordingError(f"cannot write messages of type {message_type.name}: its layout is not known")
    table = np.tile(np.frombuffer(template, dtype=np.uint8), (len(stamps), 1))
    if message_type.has_header:
        _put(table, layout.blocks_of(f"{STAMP}.sec"), (stamps // 1_000_000_000)[:, None])
        _put(table, layout.blocks_of(f"{STAMP}.nanosec"), (stamps % 1_000_000_000)[:, None])
    for field, values in fields.items():
        blocks = layout.blocks_of(field)
        room = sum(block.count for block in blocks)
        if room != values.shape[1]:
            raise RecordingError(f"{message_type.name}.{field} has room for {room} numbers, got {values.shape[1]}")
        _put(table, blocks, values)
    return [row.tobytes() for row in table]


def blank_message(message_type: MessageType) -> Any:
    """A message with zeros and empty texts everywhere, to be filled in."""
    return _blank(message_type, message_type.name, "", {}, ())


def _put(table: NDArray[np.uint8], blocks: list[Any], values: NDArray[Any]) -> None:
    column = 0
    for block in blocks:
        part = np.ascontiguousarray(values[:, column : column + block.count].astype(block.dtype))
        table[:, block.offset : block.offset + part.dtype.itemsize * block.count] = part.view(np.uint8)
        column += block.count


def _blank(message_type: MessageType, msgtype: str, path: str, lengths: dict[str, int], names: tuple[str, ...]) -> Any:
    """A message with zeros everywhere, and lists of the wanted lengths."""
    values = {}
    for name, kind in message_type.fields_of(msgtype):
        inside = f"{path}.{name}" if path else name
        if inside == "name" and is_list_of_texts(kind):
            values[name] = list(names)
        else:
            values[name] = _blank_field(message_type, kind, inside, lengths, names)
    return message_type.typestore.types[msgtype](**values)


def _blank_field(
    message_type: MessageType, kind: Any, path: str, lengths: dict[str, int], names: tuple[str, ...]
) -> Any:
    from rosbags.interfaces import Nodetype

    if kind[0] == Nodetype.NAME:
        return _blank(message_type, kind[1], path, lengths, names)
    if kind[0] == Nodetype.BASE:
        return {"string": "", "bool": False}.get(kind[1][0], 0)
    element = kind[1][0]
    count = kind[1][1] if kind[0] == Nodetype.ARRAY else lengths.get(path, 0)
    if element[0] == Nodetype.NAME:
        return [_blank(message_type, element[1], f"{path}.{k}", lengths, names) for k in range(count)]
    if element[1][0] == "string":
        return [""] * count
    return np.zeros(count, dtype=NUMPY_TYPES[element[1][0]])
