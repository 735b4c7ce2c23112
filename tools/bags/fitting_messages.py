# SPDX-License-Identifier: BSD-3-Clause
"""Which messages of a topic belong together, by the names in them: several nodes may publish on one topic.

Of messages that name joints, those are used that name all that are wanted, in whatever order and whatever else they
name. Where none names all, as those of two drivers on one topic, all that name some of them are woven together. Of
messages without names, those with the right number of values. All others are left out and counted by what they
are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.messages.columns import Columns, LeftOut
from jointscope.tools.bags.messages.joined_topics import PLUS
from jointscope.tools.bags.messages.message_parts import MessageParts, message_parts
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.messages.open_bag import RawTopic
from jointscope.tools.bags.woven_messages import woven

NAMES_SAID = 6
FEWEST = 8  # messages of a node that make it one that belongs to the recording


def read_columns(
    topic: RawTopic,
    message_type: MessageType,
    field: str,
    decode_all: bool = False,
    first: int = 0,
    wanted: Sequence[str] = (),
    width: int | None = None,
) -> Columns:
    """One field of the messages of a topic that belong together.

    Args:
        topic: the messages.
        message_type: their type.
        field: dotted path of the numbers.
        decode_all: decode every message in full, as a reference for the fast path.
        first: number of the first message in its topic.
        wanted: names that a message must have; empty for those that most messages share.
        width: number of values of messages without names; None for what most have.
    """
    return fitting_messages(message_parts(topic, message_type, field, decode_all, first), wanted, width)


def fitting_messages(found: MessageParts, wanted: Sequence[str] = (), width: int | None = None) -> Columns:
    """The messages that fit.

    Args:
        found: the messages in parts.
        wanted: names that a message must have; empty for those that most messages share.
        width: number of values that a message without names must have; None for what most messages have.

    Returns:
        Their columns: the wanted names first, then others that all of them have. Without wanted names, those of all
        nodes that tell of different joints. Where no message fits, the largest part as it is.
    """
    parts = found.parts
    if len(parts) == 1:
        return _with_broken(parts[0], found.broken)
    named = _told_once([part for part in parts if _is_sound(part)])
    if not wanted and PLUS in found.topic:
        wanted = tuple(dict.fromkeys(name for part in named for name in part.names or ()))
    core = tuple(wanted) or _most_shared(named)
    if core:
        chosen = [part for part in named if set(core) <= set(part.names or ())]
        if not chosen and wanted and all(any(name in (part.names or ()) for part in named) for name in core):
            used = {id(part) for part in named}
            others = [part for part in parts if id(part) not in used or not set(part.names or ()) & set(core)]
            return woven(named, core, tuple([*_kinds(others, set(core)), *_broken(found.broken)]))
    else:
        chosen = []
    if core and not wanted and (nodes := _nodes(named, core)):
        return _of_nodes(found, nodes)
    if not chosen:
        return _with_broken(_unnamed(parts, width), found.broken)
    first = chosen[0].names or ()
    common = [name for name in first if name not in core and all(name in (part.names or ()) for part in chosen)]
    names = (*core, *common) if wanted else tuple(name for name in first if name in {*core, *common})
    used = {id(part) for part in chosen}
    return _together(chosen, names, [part for part in parts if id(part) not in used], found.broken)


def left_out_notices(name: str, columns: Columns) -> list[Notice]:
    """What was left out because it does not fit the other messages."""
    if not columns.left_out:
        return []
    said = ", ".join(f"{counted(part.count, 'message')} {part.what}" for part in columns.left_out)
    return [Notice(name, "foreign", sum(part.count for part in columns.left_out), f"{name}: left out {said}")]


def remaining(found: MessageParts, used: Columns) -> MessageParts:
    """The messages that were left out, for whom they may concern."""
    rows = set(() if used.rows is None else used.rows.tolist())
    parts = [part for part in found.parts if part.rows is not None and not rows & set(part.rows.tolist())]
    return MessageParts(found.topic, found.field, tuple(parts), 0)


def _is_sound(part: Columns) -> bool:
    """Whether the messages have one name for every value."""
    names = part.names or ()
    return bool(names) and len(names) == part.values.shape[1] and len(set(names)) == len(names)


def _told_once(named: Sequence[Columns]) -> list[Columns]:
    """The parts without an aggregator, which repeats later what several nodes say; without these where it says more."""
    left = list(named)
    for whole in named:
        own = set(whole.names or ())
        pieces = [part for part in left if set(part.names or ()) < own]
        names = [name for part in pieces for name in part.names or ()]
        if len(pieces) > 1 and len(names) == len(set(names)) and set(names) == own:
            rarest = min(len(part.values) for part in pieces)
            spare = [whole] if rarest >= max(len(whole.values), FEWEST) else pieces
            left = [part for part in left if all(part is not other for other in spare)]
    return left


def _nodes(named: Sequence[Columns], core: tuple[str, ...]) -> list[list[Columns]]:
    """Parts by the node that they come from, where several tell of different joints; empty where there is but one."""
    nodes: list[list[Columns]] = []
    left = list(named)
    while left:
        nodes.append([part for part in left if set(core) <= set(part.names or ())])
        used = {name for node in nodes for part in node for name in part.names or ()}
        left = [part for part in left if not set(part.names or ()) & used]
        core = _most_shared(left)
    nodes = [node for node in nodes if sum(len(part.values) for part in node) >= FEWEST]
    return nodes if len(nodes) > 1 else []


def _of_nodes(found: MessageParts, nodes: Sequence[Sequence[Columns]]) -> Columns:
    """What several nodes tell, each of the joints that all of its messages name."""
    used = {id(part) for node in nodes for part in node}
    shared = [
        [name for name in node[0].names or () if all(name in (part.names or ()) for part in node)] for node in nodes
    ]
    names = tuple(name for own in shared for name in own)
    others = [part for part in found.parts if id(part) not in used]
    left_out = (*_kinds(others, set(names)), *_broken(found.broken))
    return woven([part for node in nodes for part in node], names, left_out)


def _most_shared(named: Sequence[Columns]) -> tuple[str, ...]:
    """Names of the part that brings the most values, over all messages that have them."""

    def values(part: Columns) -> int:
        own = set(part.names or ())
        return len(own) * sum(len(other.values) for other in named if own <= set(other.names or ()))

    return max(named, key=values).names or () if named else ()


def _unnamed(parts: Sequence[Columns], width: int | None) -> Columns:
    """The messages without names that have the right number of values; without any the largest part."""
    plain = [part for part in parts if not part.names and part.values.shape[1]]
    if width is not None:
        plain = [part for part in plain if part.values.shape[1] == width]
    if not plain:
        return parts[0]
    best = plain[0]
    return _together([best], None, [part for part in parts if part is not best], 0)


def _together(
    chosen: Sequence[Columns], names: tuple[str, ...] | None, others: Sequence[Columns], broken: int
) -> Columns:
    rows = np.concatenate([part.rows for part in chosen if part.rows is not None])
    order = np.argsort(rows, kind="stable")
    values = []
    for part in chosen:
        at = {name: k for k, name in enumerate(part.names or ())}
        values.append(part.values if names is None else part.values[:, [at[name] for name in names]])
    stamps = [part.stamps for part in chosen if part.stamps is not None]
    return Columns(
        np.concatenate(stamps)[order] if stamps else None,
        np.concatenate(values)[order],
        chosen[0].names if names is None else names,
        rows[order],
        tuple([*_kinds(others, {*(names or ())}), *_broken(broken)]),
    )


def _with_broken(part: Columns, broken: int) -> Columns:
    return replace(part, left_out=(*part.left_out, *_broken(broken)))


def _broken(count: int) -> list[LeftOut]:
    return [LeftOut(count, "that cannot be decoded")] if count else []


def _kinds(others: Sequence[Columns], used: set[str]) -> list[LeftOut]:
    """What the messages are that do not fit."""
    kinds: Counter[str] = Counter()
    foreign: dict[str, None] = {}
    for part in others:
        names, width = part.names or (), part.values.shape[1]
        if not width:
            kind = "without values"
        elif names and len(names) != width:
            kind = f"with {width} value{'s' * (width != 1)} for {len(names)} names"
        elif len(set(names)) < len(names):
            kind = "in which a joint stands twice"
        elif not names:
            kind = f"without names, of {width} value{'s' * (width != 1)}" if used else f"of {width} values"
        elif used and used <= set(names):
            kind = "of another node that repeats what those of the joints say"
        elif used & set(names):
            kind = "that lack some of the joints"
        else:
            kind = "of other joints"
            foreign |= dict.fromkeys(names)
        kinds[kind] += len(part.values)
    listed = ", ".join([*list(foreign)[:NAMES_SAID], *["..."] * (len(foreign) > NAMES_SAID)])
    return [LeftOut(n, f"{kind} ({listed})" if kind == "of other joints" else kind) for kind, n in kinds.most_common()]
