# SPDX-License-Identifier: BSD-3-Clause
"""Rows of numbers of which at most so many are kept: when it is full, every second one goes, evenly over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FIRST = 4096  # rows
MOST = 1 << 17  # rows: 131 s at 1 kHz are kept whole


class ThinnedRows:
    """Rows 0, k, 2 k, ... of all that were offered; k is a power of two.

    Attributes:
        stride: k.
    """

    def __init__(self, width: int, most: int = MOST):
        """Empty.

        Args:
            width: numbers in a row.
            most: rows kept, even.
        """
        self.stride = 1
        self._most = most
        self._offered = 0
        self._kept = 0
        self._rows = np.empty((min(FIRST, most), width))

    def next(self) -> Array | None:
        """Where to write the next row, shape (width,); None where it is not wanted."""
        wanted = self._offered % self.stride == 0
        self._offered += 1
        if not wanted:
            return None
        if self._kept == self._most:
            # the row at hand has number stride * most, a multiple of the doubled stride
            self._rows[: self._most // 2] = self._rows[::2].copy()
            self._kept, self.stride = self._most // 2, 2 * self.stride
        elif self._kept == len(self._rows):
            grown = np.empty((min(2 * len(self._rows), self._most), self._rows.shape[1]))
            grown[: self._kept] = self._rows
            self._rows = grown
        self._kept += 1
        return self._rows[self._kept - 1]

    @property
    def rows(self) -> Array:
        """What was kept, shape (m, width)."""
        return self._rows[: self._kept]
