# SPDX-License-Identifier: BSD-3-Clause
"""Messages that are about some joints each, woven into one table: several drivers publish on one topic.

An arm and its gripper, or one node for each drive, share a topic such as /joint_states. Each message is a row at its
own stamp; columns of joints that it is not about are absent there. Messages of different nodes with one stamp are one
row.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.bags.messages.columns import Columns, LeftOut

Flags = NDArray[np.bool_]
Numbers = NDArray[np.int64]

UNFILLED = 0.5  # share of the messages of one node that must have stamps of their own


def woven(parts: Sequence[Columns], names: tuple[str, ...], left_out: tuple[LeftOut, ...] = ()) -> Columns:
    """All messages that are about some of the joints.

    Args:
        parts: messages with the same names each, with their `rows`.
        names: of the joints, one column each.
        left_out: messages that are not used.

    Returns:
        Columns in the order of the bag. What is NaN and not `absent` is what its node said.
    """
    parts = [part for part in parts if set(part.names or ()) & set(names)]
    rows = np.concatenate([_rows(part) for part in parts])
    stamped = all(part.stamps is not None for part in parts)
    stamps = np.concatenate([part.stamps for part in parts if part.stamps is not None]) if stamped else rows.copy()
    node = np.repeat(np.arange(len(parts)), [len(part.values) for part in parts])
    values = np.full((len(rows), len(names)), np.nan)
    about = np.zeros(values.shape, bool)
    begin = 0
    for part in parts:
        own, end = part.names or (), begin + len(part.values)
        here = [k for k, name in enumerate(names) if name in own]
        values[begin:end, here] = part.values[:, [own.index(names[k]) for k in here]]
        about[begin:end, here] = True
        begin = end
    if stamped and _tell(stamps, node):
        rows, stamps, values, about = _joined(rows, stamps, values, about, node)
    order = np.argsort(rows, kind="stable")
    rows, stamps, values, about = rows[order], stamps[order], values[order], about[order]
    return Columns(stamps if stamped else None, values, names, rows, left_out, None if about.all() else ~about)


def _rows(part: Columns) -> NDArray[np.intp]:
    return np.arange(len(part.values)) if part.rows is None else part.rows


def _tell(stamps: Numbers, node: NDArray[np.intp]) -> bool:
    """Whether stamps say which messages belong to one instant; those that nobody filled are all the same."""
    return len(np.unique(stamps)) > UNFILLED * int(np.bincount(node).max())


def _joined(
    rows: NDArray[np.intp], stamps: Numbers, values: NDArray[np.float64], about: Flags, node: NDArray[np.intp]
) -> tuple[NDArray[np.intp], Numbers, NDArray[np.float64], Flags]:
    """Messages of different nodes with one stamp as one row; those of one node with one stamp stay apart."""
    order = np.lexsort((rows, stamps, node))
    new = (np.diff(stamps[order], prepend=-1) != 0) | (np.diff(node[order], prepend=-1) != 0)
    place = np.arange(len(rows))
    which = np.empty(len(rows), np.intp)
    which[order] = place - np.maximum.accumulate(np.where(new, place, 0))  # first, second, ... with this stamp
    keys, first, group = np.unique(np.column_stack([stamps, which]), axis=0, return_index=True, return_inverse=True)
    joined = np.full((len(keys), values.shape[1]), np.nan)
    known = np.zeros(joined.shape, bool)
    group = group.reshape(-1)
    for k in np.argsort(-rows, kind="stable"):  # of two nodes that tell of one joint the first counts
        joined[group[k], about[k]] = values[k, about[k]]
        known[group[k]] |= about[k]
    earliest = np.full(len(keys), rows.max())
    np.minimum.at(earliest, group, rows)
    return earliest, stamps[first], joined, known
