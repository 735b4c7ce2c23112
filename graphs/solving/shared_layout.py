# SPDX-License-Identifier: BSD-3-Clause
"""Where the shared values of several recordings stand in one vector.

Dynamics and rotations are shared by all recordings; each recording has its own biases:
(dynamics, rotations, biases of bag 0, biases of bag 1, ...). A recording may come in pieces; they share its biases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.solving.normal_equations import layout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SharedLayout:
    """Indices of every recording's shared values in the global vector.

    Attributes:
        columns: columns of each block within one recording.
        common: number of values that all recordings share.
        own: number of values that each recording has for itself.
        owners: recording that each piece belongs to, 0, 1, ...; a recording given whole is one piece.
    """

    columns: dict[str, slice]
    common: int
    own: int
    owners: tuple[int, ...]

    @staticmethod
    def of(calibration: Calibration, owners: int | Sequence[int]) -> SharedLayout:
        """The layout for recordings of one robot.

        Args:
            calibration: shared values of one recording.
            owners: recording of each piece, or the number of recordings that are given whole.
        """
        columns = layout(calibration)
        own = 3 * len(calibration.biases)
        pieces = tuple(range(owners)) if isinstance(owners, int) else tuple(owners)
        return SharedLayout(columns, max(c.stop for c in columns.values()) - own, own, pieces)

    @property
    def bags(self) -> int:
        """Number of recordings."""
        return max(self.owners) + 1

    @property
    def size(self) -> int:
        """Length of the global vector."""
        return self.common + self.own * self.bags

    def indices(self, piece: int) -> NDArray[np.intp]:
        """Global indices of the values of a piece, in its recording's order."""
        start = self.common + self.owners[piece] * self.own
        return np.concatenate([np.arange(self.common), np.arange(start, start + self.own)])

    def step(self, dp: Array, bag: int) -> dict[str, Array]:
        """The part of a global step that concerns a recording, block by block."""
        local = dp[self.indices(bag)]
        return {block: local[columns] for block, columns in self.columns.items()}
