# SPDX-License-Identifier: BSD-3-Clause
"""The messages of a topic in parts that are laid out alike, so that foreign messages cost little and harm nothing.

Where all messages have one layout there is one part, on the fast path. Else messages of the same size and with the same
bytes at the places that determine the layout form a part, which takes the fast path by itself; what is left over is
decoded message by message. Messages that cannot be decoded are counted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.messages.byte_layout import byte_layout
from jointscope.tools.bags.messages.columns import Columns
from jointscope.tools.bags.messages.fast_columns import fast_columns
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.messages.open_bag import RawTopic
from jointscope.tools.bags.messages.slow_columns import slow_columns

Rows = NDArray[np.intp]

MOST_LAYOUTS = 64  # tried on the fast path before the rest is decoded one by one
BYTE = 256.0
HOPELESS = 200  # messages without a number in the wanted field, and none with, are enough to know
BROKEN_SHARE, FEW_BROKEN = 0.01, 5  # of the messages, or so many, may be unreadable


@dataclass(frozen=True)
class MessageParts:
    """One field of one topic.

    Attributes:
        topic: its name.
        field: dotted path of the numbers.
        parts: messages with the same names and number of values, the largest part first; `rows` tells which.
        broken: messages that cannot be decoded or hold no numbers there.
    """

    topic: str
    field: str
    parts: tuple[Columns, ...]
    broken: int


def message_parts(
    topic: RawTopic, message_type: MessageType, field: str, decode_all: bool = False, first: int = 0
) -> MessageParts:
    """Reads one field of all messages.

    Args:
        topic: the messages, at least one.
        message_type: their type.
        field: dotted path of the numbers.
        decode_all: decode every message in full, as a reference for the fast path.
        first: number of the first message in its topic, for messages to the user.

    Raises:
        RecordingError: no message holds numbers there, or more than a few are damaged.
    """
    whole = None if decode_all else fast_columns(topic.data, message_type, field)
    if whole is not None:
        return MessageParts(topic.name, field, (whole,), 0)
    found: list[Columns] = []
    single: list[Rows] = []
    for rows in [np.arange(len(topic.data))] if decode_all else _alike(topic.data, message_type):
        columns = None if decode_all else fast_columns([topic.data[k] for k in rows], message_type, field)
        if columns is None:
            single.append(rows)
        else:
            found.append(Columns(columns.stamps, columns.values, columns.names, rows))
    broken = 0
    if single:
        one_by_one, broken = _decoded(topic, message_type, field, np.sort(np.concatenate(single)), first, not found)
        found += one_by_one
    parts = sorted(_merged(found), key=lambda part: -len(part.values))
    return MessageParts(topic.name, field, tuple(parts), broken)


def _alike(raw: Sequence[bytes], message_type: MessageType) -> Iterator[Rows]:
    """Messages with the same layout; single ones where it is not known."""
    sizes = np.fromiter(map(len, raw), dtype=np.intp, count=len(raw))
    tries = 0
    for size in np.unique(sizes):
        rows = np.flatnonzero(sizes == size)
        table = np.frombuffer(b"".join(raw[k] for k in rows.tolist()), dtype=np.uint8).reshape(len(rows), int(size))
        left = np.arange(len(rows))
        while len(left) and tries < MOST_LAYOUTS:
            tries += 1
            layout = byte_layout(raw[int(rows[left[0]])], message_type)
            same = np.zeros(len(left), bool)
            same[0] = True
            if layout is not None:
                fixed = layout.fixed
                same = np.all(table[np.ix_(left, fixed)] == table[left[0], fixed], axis=1)
            yield rows[left[same]]
            left = left[~same]
        if len(left):
            yield rows[left]


def _decoded(
    topic: RawTopic, message_type: MessageType, field: str, rows: Rows, first: int, alone: bool
) -> tuple[list[Columns], int]:
    """Messages decoded one by one, and how many could not be; `alone` if there are no others."""
    found: list[Columns] = []
    broken: list[RecordingError] = []
    unsigned = message_type.ros2 and message_type.holds_bytes(field)  # the decoder takes them as signed
    for k in rows:
        try:
            columns = slow_columns([topic.data[k]], message_type, field, topic.name, first + int(k))
            values = np.where(columns.values < 0, columns.values + BYTE, columns.values) if unsigned else columns.values
            found.append(Columns(columns.stamps, values, columns.names, np.array([k])))
        except RecordingError as err:
            broken.append(err)
            if alone and not found and len(broken) >= HOPELESS:
                break
    if broken and ((alone and not found) or len(broken) > max(FEW_BROKEN, BROKEN_SHARE * len(topic.data))):
        raise broken[0]
    return found, len(broken)


def _merged(found: Sequence[Columns]) -> list[Columns]:
    """Parts with the same names and number of values put together, in the order of the bag."""
    groups: dict[tuple[tuple[str, ...] | None, int], list[Columns]] = {}
    for part in found:
        groups.setdefault((part.names, part.values.shape[1]), []).append(part)
    merged = []
    for (names, _), parts in groups.items():
        rows = np.concatenate([part.rows for part in parts if part.rows is not None])
        order = np.argsort(rows, kind="stable")
        stamps = [part.stamps for part in parts if part.stamps is not None]
        merged.append(
            Columns(
                np.concatenate(stamps)[order] if stamps else None,
                np.concatenate([part.values for part in parts])[order],
                names,
                rows[order],
            )
        )
    return merged
