# SPDX-License-Identifier: BSD-3-Clause
"""The reference: every message is decoded in full. It also knows which message is to blame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.messages.columns import Columns
from jointscope.tools.bags.messages.field_path import field_path
from jointscope.tools.bags.messages.message_type import MessageType


def slow_columns(raw: Sequence[bytes], message_type: MessageType, field: str, topic: str, first: int = 0) -> Columns:
    """One field over all messages.

    Args:
        raw: bytes of each message.
        message_type: their type.
        field: dotted path of the numbers.
        topic: name of the topic, for messages to the user.
        first: number of the first message in its topic, for messages to the user.

    Returns:
        The columns.

    Raises:
        RecordingError: a message cannot be decoded, holds no numbers there, or differs in the joint names or in the
            number of values.
    """
    where = field_path(message_type, field, topic)
    rows: list[list[float]] = []
    stamps = np.zeros(len(raw), dtype=np.int64)
    names: tuple[str, ...] | None = None
    for row_number, data in enumerate(raw):
        k = first + row_number
        message = _decode(data, message_type, topic, k)
        if message_type.has_header:
            stamps[row_number] = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        try:
            here = where.names_in(message)
            row = where.numbers(message)
        except (AttributeError, IndexError, TypeError, ValueError) as err:
            raise RecordingError(f"topic {topic}, message {k}: the field {field!r} holds no numbers") from err
        names = names if here is None else _same_names(names, here, topic, k)
        if rows and len(row) != len(rows[0]):
            raise RecordingError(
                f"topic {topic}, message {k}: the field {field!r} holds {len(row)} values; "
                f"expected {len(rows[0])} as in message {first}"
            )
        rows.append(row)
    values = np.array(rows, dtype=np.float64).reshape(len(raw), len(rows[0]) if rows else 0)
    return Columns(stamps if message_type.has_header else None, values, names)


def _decode(data: bytes, message_type: MessageType, topic: str, k: int) -> Any:
    try:
        return message_type.decode(data)
    except RecordingError as err:
        raise RecordingError(f"topic {topic}, message {k}: its {err}") from err


def _same_names(before: tuple[str, ...] | None, now: tuple[str, ...], topic: str, k: int) -> tuple[str, ...]:
    if before is not None and now != before:
        what = "order of the joint names changes" if sorted(before) == sorted(now) else "joint names change"
        raise RecordingError(
            f"topic {topic}, message {k}: the {what}: expected {', '.join(before)} as in message 0, "
            f"got {', '.join(now) or 'none'}"
        )
    return now
