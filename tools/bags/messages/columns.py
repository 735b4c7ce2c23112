# SPDX-License-Identifier: BSD-3-Clause
"""One field of one topic over all messages, as arrays, before names, units and order are looked at."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

STAMP = "header.stamp"


@dataclass(frozen=True)
class LeftOut:
    """Messages of one kind that were not used.

    Attributes:
        count: how many.
        what: what they are, to follow the count: "that name other joints (finger_joint)".
    """

    count: int
    what: str


@dataclass(frozen=True)
class Columns:
    """What the messages of a topic say.

    Attributes:
        stamps: header stamps, shape (n,) [ns]; None where the message type has no header.
        values: the field's numbers in the order of the message, shape (n, m), in the unit of the bag.
        names: what the messages call the columns, the same in all of them; None where their type has no such texts.
        rows: place in the topic of the message behind each row, shape (n,); None where all messages are used.
        left_out: messages that do not fit the others.
        absent: where the message of a row is not about a column, because another node tells of that joint: a value
            there is NaN and missing nowhere, shape (n, m); None where all messages are about all.
    """

    stamps: NDArray[np.int64] | None
    values: NDArray[np.float64]
    names: tuple[str, ...] | None
    rows: NDArray[np.intp] | None = None
    left_out: tuple[LeftOut, ...] = ()
    absent: NDArray[np.bool_] | None = None

    def of(self, per_message: NDArray[Any]) -> NDArray[Any]:
        """What belongs to the rows, of something that is there for every message of the topic, shape (n, ...)."""
        return per_message if self.rows is None else per_message[self.rows]

    def take(self, index: NDArray[Any]) -> Columns:
        """Some of the rows."""
        every = np.arange(len(self.values)) if self.rows is None else self.rows
        stamps = None if self.stamps is None else self.stamps[index]
        absent = None if self.absent is None else self.absent[index]
        return replace(self, stamps=stamps, values=self.values[index], rows=every[index], absent=absent)
