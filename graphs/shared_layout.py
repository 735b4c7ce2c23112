# SPDX-License-Identifier: BSD-3-Clause
"""Where the shared values of several recordings stand in one vector.

Dynamics and rotations are shared by all recordings; each recording has its own biases:
(dynamics, rotations, biases of bag 0, biases of bag 1, ...).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.normal_equations import layout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SharedLayout:
    """Indices of every recording's shared values in the global vector.

    Attributes:
        columns: columns of each block within one recording.
        common: number of values that all recordings share.
        own: number of values that each recording has for itself.
        bags: number of recordings.
    """

    columns: dict[str, slice]
    common: int
    own: int
    bags: int

    @staticmethod
    def of(calibration: Calibration, bags: int) -> SharedLayout:
        """The layout for recordings of one robot."""
        columns = layout(calibration)
        own = 3 * len(calibration.biases)
        return SharedLayout(columns, max(c.stop for c in columns.values()) - own, own, bags)

    @property
    def size(self) -> int:
        """Length of the global vector."""
        return self.common + self.own * self.bags

    def indices(self, bag: int) -> NDArray[np.intp]:
        """Global indices of a recording's values, in the recording's order."""
        start = self.common + bag * self.own
        return np.concatenate([np.arange(self.common), np.arange(start, start + self.own)])

    def step(self, dp: Array, bag: int) -> dict[str, Array]:
        """The part of a global step that concerns a recording, block by block."""
        local = dp[self.indices(bag)]
        return {block: local[columns] for block, columns in self.columns.items()}
