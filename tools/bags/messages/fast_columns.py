# SPDX-License-Identifier: BSD-3-Clause
"""Fast and exact: all messages of a topic as one table of bytes, and the wanted numbers as strided views of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.bags.messages.byte_layout import Block, byte_layout
from jointscope.tools.bags.messages.columns import STAMP, Columns
from jointscope.tools.bags.messages.field_path import field_path
from jointscope.tools.bags.messages.message_type import MessageType


def fast_columns(raw: Sequence[bytes], message_type: MessageType, field: str) -> Columns | None:
    """One field over all messages, if all messages have the same layout.

    Args:
        raw: bytes of each message.
        message_type: their type.
        field: dotted path of the numbers.

    Returns:
        The columns; None where any message differs in size, list length, text or encoding, so that only full
        deserialization can be trusted.
    """
    layout = byte_layout(raw[0], message_type) if raw else None
    if layout is None or any(len(message) != layout.size for message in raw):
        return None
    table = np.frombuffer(b"".join(raw), dtype=np.uint8).reshape(len(raw), layout.size)
    fixed = layout.fixed
    if not np.array_equal(table[:, fixed], np.broadcast_to(table[0, fixed], (len(raw), len(fixed)))):
        return None
    stamps = None
    if message_type.has_header:
        seconds, nanoseconds = (_numbers(table, layout.blocks_of(f"{STAMP}.{part}")) for part in ("sec", "nanosec"))
        stamps = seconds[:, 0].astype(np.int64) * 1_000_000_000 + nanoseconds[:, 0].astype(np.int64)
    if any(path == field or path.startswith(field + ".") for path in layout.texts):
        return None
    where = field_path(message_type, field, "")
    try:
        blocks = where.blocks(layout)
    except (KeyError, ValueError):
        return None
    return Columns(stamps, _numbers(table, blocks), where.names_of(layout))


def _numbers(table: NDArray[np.uint8], blocks: list[Block]) -> NDArray[np.float64]:
    """The numbers of some blocks as float64, shape (n, m); exact for everything a double can hold."""
    parts = []
    for block in blocks:
        end = block.offset + block.count * np.dtype(block.dtype).itemsize
        parts.append(np.ascontiguousarray(table[:, block.offset : end]).view(block.dtype).astype(np.float64))
    return np.hstack(parts) if parts else np.empty((len(table), 0))
