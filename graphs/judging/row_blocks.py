# SPDX-License-Identifier: BSD-3-Clause
"""Blocks of rows that are left out together: two seconds of motion, or a tenth of what little there is.

What is whitened remembers nothing of another block, and a candidate helps on so many of so many of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.judging.torque_rows import TorqueRows

BLOCK = 2.0  # [s] at the most
FEWEST_ROWS = 10  # of a block that counts


def blocks_of(rows: TorqueRows) -> NDArray[np.intp]:
    """Block of each row, from 0 on, those with few rows joined to the one before, shape (m,)."""
    told = float(np.sum(np.minimum(np.diff(rows.times), 1.0))) if len(rows.times) else 0.0
    length = min(BLOCK, max(told, 1e-3) / 10.0)
    raw = ((rows.times - rows.times[0]) / length).astype(int)
    found, now, count = np.zeros(len(raw), np.intp), 0, 0
    for i in range(len(raw)):
        if i and raw[i] != raw[i - 1] and count >= FEWEST_ROWS:
            now, count = now + 1, 0
        found[i], count = now, count + 1
    return found
