# SPDX-License-Identifier: BSD-3-Clause
"""One field of one topic over all messages, as arrays, before names, units and order are looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STAMP = "header.stamp"


@dataclass(frozen=True)
class Columns:
    """What the messages of a topic say.

    Attributes:
        stamps: header stamps, shape (n,) [ns]; None where the message type has no header.
        values: the field's numbers in the order of the message, shape (n, m), in the unit of the bag.
        names: what the messages call the columns, the same in all of them; None where their type has no such texts.
    """

    stamps: NDArray[np.int64] | None
    values: NDArray[np.float64]
    names: tuple[str, ...] | None
