# SPDX-License-Identifier: BSD-3-Clause
"""Where every number of a message lies in its bytes.

The layout follows from the type and from the lengths of the lists and texts in one message. A message of the same
size with the same bytes at the `fixed` places (lengths, texts, encoding) therefore has the same layout, exactly.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.bags.messages.message_type import MessageType

CDR_HEADER = 4  # bytes; alignment counts from behind it
LITTLE_ENDIAN = 1
MANY_ELEMENTS = 64  # lists of messages longer than this are not worth a layout


@dataclass(frozen=True)
class Block:
    """Consecutive numbers of one type.

    Attributes:
        path: dotted path of the field.
        offset: first byte in the message.
        dtype: numpy type of one number.
        count: how many.
    """

    path: str
    offset: int
    dtype: str
    count: int


@dataclass
class ByteLayout:
    """The layout of one message.

    Attributes:
        size: number of bytes.
        blocks: all numbers.
        texts: all texts in lists or alone, by dotted path of the field.
        fixed_ranges: first and last + 1 byte of everything that determines the layout.
    """

    size: int
    blocks: list[Block] = field(default_factory=list)
    texts: dict[str, list[str]] = field(default_factory=dict)
    fixed_ranges: list[tuple[int, int]] = field(default_factory=list)

    @property
    def fixed(self) -> NDArray[np.intp]:
        """Index of every byte that must not change."""
        ranges = [np.arange(start, stop) for start, stop in self.fixed_ranges]
        return np.concatenate(ranges) if ranges else np.empty(0, dtype=np.intp)

    def blocks_of(self, path: str) -> list[Block]:
        """All numbers in a field and below it, in the order of the message."""
        return [block for block in self.blocks if block.path == path or block.path.startswith(path + ".")]


def byte_layout(raw: bytes, message_type: MessageType) -> ByteLayout | None:
    """The layout of a message; None where this file does not know how (big-endian, exotic types, odd size)."""
    walk = _Walk(bytes(raw), message_type)
    try:
        if message_type.ros2:
            if len(raw) < CDR_HEADER or raw[1] != LITTLE_ENDIAN:
                return None
            walk.layout.fixed_ranges.append((0, CDR_HEADER))
        walk.message(message_type.name, "")
    except (KeyError, IndexError, ValueError, struct.error):
        return None
    padding = len(raw) - walk.position
    return walk.layout if 0 <= padding <= (3 if message_type.ros2 else 0) else None


class _Walk:
    """Steps through the bytes of one message, field by field."""

    def __init__(self, raw: bytes, message_type: MessageType):
        self.raw = raw
        self.type = message_type
        self.position = CDR_HEADER if message_type.ros2 else 0
        self.layout = ByteLayout(len(raw))

    def message(self, msgtype: str, path: str) -> None:
        for name, kind in self.type.fields_of(msgtype):
            self.field(kind, f"{path}.{name}" if path else name)

    def field(self, kind: Any, path: str) -> None:
        from rosbags.interfaces import Nodetype

        if kind[0] == Nodetype.BASE:
            self.primitives(kind[1][0], path, 1)
        elif kind[0] == Nodetype.NAME:
            self.message(kind[1], path)
        else:
            element = kind[1][0]
            count = kind[1][1] if kind[0] == Nodetype.ARRAY else self.length()
            if element[0] == Nodetype.BASE:
                self.primitives(element[1][0], path, count)
                return
            if count > MANY_ELEMENTS:
                raise ValueError("too many elements")
            for index in range(count):
                self.message(element[1], f"{path}.{index}")

    def primitives(self, name: str, path: str, count: int) -> None:
        if name == "string":
            self.layout.texts.setdefault(path, []).extend(self.text() for _ in range(count))
            return
        dtype = self.type.numpy_type(name)
        if not count:
            return
        size = np.dtype(dtype).itemsize
        self.align(size)
        self.layout.blocks.append(Block(path, self.position, dtype, count))
        self.position += size * count

    def text(self) -> str:
        length = self.length()
        start, self.position = self.position, self.position + length
        if self.position > len(self.raw):
            raise ValueError("text beyond the end")
        self.layout.fixed_ranges.append((start, self.position))
        return self.raw[start : self.position].decode().rstrip("\0" if self.type.ros2 else "")

    def length(self) -> int:
        self.align(4)
        (count,) = struct.unpack_from("<I", self.raw, self.position)
        self.layout.fixed_ranges.append((self.position, self.position + 4))
        self.position += 4
        return int(count)

    def align(self, size: int) -> None:
        if self.type.ros2:
            self.position += -(self.position - CDR_HEADER) % size
