# SPDX-License-Identifier: BSD-3-Clause
"""Takes entries out of a YAML document and leaves the comments that stand on lines of their own.

ruamel.yaml hangs a comment on the entry before it: the heading of a section on the last entry of the section above.
Whoever deletes that entry loses the heading; here it is hung on what then stands before it.
"""

from __future__ import annotations

from functools import reduce
from operator import getitem
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import CommentMark
from ruamel.yaml.tokens import CommentToken

Place = tuple[Any, Any]  # a mapping or list, and a key or index in it
ABOVE = 1  # where ruamel keeps what stands above an entry, for mappings and lists
BEFORE_CONTENT = 3  # between a key and its content


def remove_at(document: CommentedMap, *path: str | int) -> None:
    """Deletes one entry; a comment on the same line goes with it, lines of comments stay where they were.

    A mapping or list whose only entry it is goes too, as nobody writes an empty one.

    Args:
        document: changed in place.
        path: the keys that lead to the entry, for example "effects", 0; only the last one may be an index.
    """
    *way, key = path
    container = reduce(getitem, way, document)
    if len(container) == 1 and way:
        remove_at(document, *way)
        return
    lines = _lines((container, key))
    keys = list(_keys(container))
    position = keys.index(key)
    del container[key]
    if isinstance(container, CommentedMap):
        container.ca.items.pop(key, None)  # ruamel keeps them for a key of that name that may come
    if not lines:
        return
    if position > 0:
        _hang_behind(_last_place((container, keys[position - 1])), lines)
    elif way:
        _hang_below_key((reduce(getitem, way[:-1], document), way[-1]), lines)
    else:
        _hang_on_top(document, lines)


def empty_at(document: CommentedMap, key: str) -> None:
    """Takes everything out of a mapping of the document and writes it as {}; lines of comments stay.

    Args:
        document: changed in place.
        key: of the mapping.
    """
    lines = _lines((document, key))
    document[key] = CommentedMap()
    document[key].fa.set_flow_style()
    document.ca.items.pop(key, None)
    if lines:
        _hang_behind((document, key), lines)


def _lines(place: Place) -> str:
    """All lines with nothing but a comment, or with nothing at all, that hang on an entry and its content."""
    container, key = place
    if _is_flow(container):
        return ""  # ruamel drops comments between brackets whenever it writes
    slots, value = _slots(place), container[key]
    behind = _after_first_line(slots[_behind(container)])
    content = (_lines((value, inner)) for inner in _keys(value))
    blocks = (_text(slots[ABOVE]), behind, _text(slots[BEFORE_CONTENT]), *content)
    return reduce(_joined, blocks, "\n").removeprefix("\n")


def _last_place(place: Place) -> Place:
    """The entry that ends where this one ends; what follows hangs on it."""
    container, key = place
    value = container[key]
    if _is_flow(value) or not _keys(value):
        return place
    return _last_place((value, list(_keys(value))[-1]))


def _hang_behind(place: Place, lines: str) -> None:
    """Puts lines behind an entry, after those that are there."""
    container, key = place
    slots, slot = _slots(place), _behind(container)
    slots[slot] = _extended(slots[slot] or CommentToken("\n", CommentMark(0), None), lines)
    container.ca.items[key] = slots


def _hang_below_key(place: Place, lines: str) -> None:
    """Puts lines between a key and its content, after those that are there."""
    tokens = _slots(place)[BEFORE_CONTENT]
    if tokens:
        tokens[-1] = _extended(tokens[-1], lines)
    else:
        _hang_behind(place, lines)


def _hang_on_top(document: CommentedMap, lines: str) -> None:
    """Puts lines before the first key of the document, after those that are there."""
    tokens = document.ca.comment[ABOVE] if document.ca.comment else None
    if tokens:
        tokens[-1] = _extended(tokens[-1], lines)
    else:
        document.ca.comment = [None, [CommentToken(lines, CommentMark(0), None)]]


def _extended(token: CommentToken, lines: str) -> CommentToken:
    """A comment with more lines."""
    return CommentToken(_joined(token.value, lines), token.start_mark, None)


def _slots(place: Place) -> list[Any]:
    """The four places of ruamel for the comments of an entry."""
    container, key = place
    slots = list(container.ca.items.get(key) or ())
    return slots + [None] * (4 - len(slots))


def _behind(container: Any) -> int:
    """The slot of what stands behind an entry."""
    return 0 if isinstance(container, CommentedSeq) else 2


def _keys(value: Any) -> Any:
    """Keys or indices of a mapping or list; nothing for any other value."""
    if isinstance(value, CommentedMap):
        return value.keys()
    return range(len(value)) if isinstance(value, CommentedSeq) else ()


def _is_flow(value: Any) -> bool:
    """Whether a value is written in brackets."""
    return isinstance(value, CommentedMap | CommentedSeq) and value.fa.flow_style() is True


def _text(tokens: list[CommentToken] | None) -> str:
    """Comments above something, each with its indentation."""
    return "".join(" " * token.start_mark.column + token.value for token in tokens or ())


def _after_first_line(token: CommentToken | None) -> str:
    """What of a comment does not stand on the line of its entry."""
    return token.value.partition("\n")[2] if token is not None else ""


def _joined(before: str, lines: str) -> str:
    """Two blocks of lines, with one empty line between them if both had one; the first begins behind an entry."""
    if before.endswith("\n\n"):
        return before + lines.removeprefix("\n")
    return before + lines if before.endswith("\n") else f"{before}\n{lines}"
