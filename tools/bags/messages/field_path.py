# SPDX-License-Identifier: BSD-3-Clause
"""Where the numbers of a field are in a message, and which texts of the message name them.

A dotted path descends; a number takes one element of a list, `*` takes the rest of the path of every element
("motor_state.*.q"), and a text behind a list of numbers takes the one that a list of texts beside it calls so
("interface_values.*.values.effort"). Columns are named by the nearest list of texts at the level of the numbers or
around it ("joint_names" for "actual.effort"), or by a text inside each element of a `*`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.messages.byte_layout import Block, ByteLayout
from jointscope.tools.bags.messages.message_type import MessageType, inner_type, is_list_of_texts, is_text

Level = tuple[tuple[str, ...], str]  # path to a message inside a message, and its type

EVERY = "*"
USUAL = ("name", "names", "joint_names", "joint_name", "joints", "joint")
"""What fields with the names of joints are usually called, most telling first."""


@dataclass(frozen=True)
class FieldPath:
    """A field of a message type.

    Attributes:
        parts: of the path to the numbers, or to the list of which one is taken by name.
        chosen: the entry of that list; empty for all of it.
        chosen_by: path of the texts among which `chosen` is looked for.
        names: path of the texts that name the columns; None where the type has none.
    """

    parts: tuple[str, ...]
    chosen: str
    chosen_by: tuple[str, ...]
    names: tuple[str, ...] | None

    def blocks(self, layout: ByteLayout) -> list[Block]:
        """Where the numbers lie.

        Raises:
            KeyError: an element has no number of the chosen name.
        """
        found = []
        for block in layout.blocks:
            path = tuple(block.path.split("."))
            if _meets(path[: len(self.parts)], self.parts):
                found.append(self._one_of(block, path, layout) if self.chosen else block)
            elif self.parts[-1].isdecimal() and _meets(path, self.parts[:-1]):
                found.append(_entry(block, int(self.parts[-1])))
        return found

    def names_of(self, layout: ByteLayout) -> tuple[str, ...] | None:
        """Names of the columns in a message."""
        if self.names is None:
            return None
        texts = (texts for path, texts in layout.texts.items() if _meets(tuple(path.split(".")), self.names or ()))
        return tuple(text for part in texts for text in part)

    def numbers(self, message: Any) -> list[float]:
        """The numbers in a decoded message.

        Raises:
            AttributeError, IndexError, TypeError, ValueError: there are none.
        """
        row: list[float] = []
        for place in _at(message, self.parts):
            _flatten(place, row)
        if not self.chosen:
            return row
        texts = [list(part) for part in _at(message, self.chosen_by)]
        lists = [list(part) for part in _at(message, self.parts)]
        return [float(part[names.index(self.chosen)]) for part, names in zip(lists, texts, strict=True)]

    def names_in(self, message: Any) -> tuple[str, ...] | None:
        """Names of the columns in a decoded message."""
        if self.names is None:
            return None
        found = list(_at(message, self.names))
        return tuple(str(text) for part in found for text in ([part] if isinstance(part, str) else part))

    def _one_of(self, block: Block, path: tuple[str, ...], layout: ByteLayout) -> Block:
        here = tuple(ours if part == EVERY else part for part, ours in zip(self.chosen_by, (*path, ""), strict=False))
        return _entry(block, layout.texts[".".join(here)].index(self.chosen))


def field_path(
    message_type: MessageType, field: str, topic: str, correct: str = "set `field` in the robot file"
) -> FieldPath:
    """A dotted field of a message type.

    Args:
        message_type: of the topic.
        field: dotted path.
        topic: for the text of an error.
        correct: what to do about a wrong field.

    Raises:
        RecordingError: there is no such field; the message lists the fields at that level.
    """
    parts = tuple(field.split("."))
    levels: list[Level] = [((), message_type.name)]
    msgtype: str | None = message_type.name
    for k, part in enumerate(parts):
        if part.isdecimal() or part == EVERY:
            levels[-1:] = [(parts[: k + 1], levels[-1][1])] if msgtype else levels[-1:]
            continue
        fields = dict(message_type.fields_of(msgtype)) if msgtype else {}
        if part in fields:
            msgtype = inner_type(fields[part])
            if msgtype:
                levels.append((parts[: k + 1], msgtype))
            continue
        beside = _list_of_texts(message_type, levels[-1]) if not msgtype and k == len(parts) - 1 else None
        if beside is None:
            raise _no_field(message_type, field, topic, part, tuple(fields), correct)
        return FieldPath(parts[:-1], part, beside, _names(message_type, levels[:-1]))
    return FieldPath(parts, "", (), _names(message_type, levels))


def _no_field(
    message_type: MessageType, field: str, topic: str, part: str, fields: tuple[str, ...], correct: str
) -> RecordingError:
    there = f"it has {', '.join(fields)}" if fields else "there is nothing below"
    return RecordingError(f"topic {topic}: {message_type.name} has no field {field!r}: no {part!r}; {there}; {correct}")


def _names(message_type: MessageType, levels: list[Level]) -> tuple[str, ...] | None:
    """The nearest texts that name columns, from the innermost level outwards."""
    for level in reversed(levels):
        found = _list_of_texts(message_type, level) or (
            _text_of_element(message_type, level) if level[0][-1:] == (EVERY,) else None
        )
        if found is not None:
            return found
    return None


def _list_of_texts(message_type: MessageType, level: Level) -> tuple[str, ...] | None:
    path, msgtype = level
    there = [name for name, kind in message_type.fields_of(msgtype) if is_list_of_texts(kind)]
    return (*path, min(there, key=_unusual)) if there else None


def _text_of_element(message_type: MessageType, level: Level) -> tuple[str, ...] | None:
    path, msgtype = level
    there = [
        name for name, kind in message_type.fields_of(msgtype) if is_text(kind) and _unusual(name) < len(USUAL) + 2
    ]
    return (*path, min(there, key=_unusual)) if there else None


def _unusual(name: str) -> int:
    """How little a field's name sounds like one with names of joints."""
    if name in USUAL:
        return USUAL.index(name)
    return len(USUAL) + (0 if "joint" in name else 1 if "name" in name else 2)


def _meets(path: tuple[str, ...], wanted: tuple[str, ...]) -> bool:
    """Whether a path without `*` is one of those that another stands for."""
    return len(path) == len(wanted) and all(
        part == other or (other == EVERY and part.isdecimal()) for part, other in zip(path, wanted, strict=True)
    )


def _entry(block: Block, k: int) -> Block:
    if k >= block.count:
        raise KeyError(f"{block.path} has {block.count} entries")
    return replace(block, offset=block.offset + k * np.dtype(block.dtype).itemsize, count=1)


def _at(value: Any, parts: tuple[str, ...]) -> Iterator[Any]:
    """Everything a path leads to in a decoded message."""
    if not parts:
        yield value
    elif parts[0] == EVERY:
        for item in value:
            yield from _at(item, parts[1:])
    else:
        yield from _at(value[int(parts[0])] if parts[0].isdecimal() else getattr(value, parts[0]), parts[1:])


def _flatten(value: Any, row: list[float]) -> None:
    if isinstance(value, np.ndarray):
        row.extend(float(x) for x in value.tolist())
    elif isinstance(value, list | tuple):
        for item in value:
            _flatten(item, row)
    elif hasattr(value, "__dataclass_fields__"):
        for name, kind in value.__dataclass_fields__.items():
            if "ClassVar" not in str(kind.type):
                _flatten(getattr(value, name), row)
    elif isinstance(value, str):
        raise TypeError("a text is not a number")
    else:
        row.append(float(value))
