# SPDX-License-Identifier: BSD-3-Clause
"""A stretch that a worker keeps, as the graph sees it: what the worker said last."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.solving.stretch import rim_columns

Array = NDArray[np.float64]


class DistantStretch:
    """Takes the place of a `RecordingStretch`.

    Args:
        ticks: first and last tick in the recording.
        d: size of a state.
        calibration: any of the recording.
        blocks: names of the blocks that may change.

    Attributes:
        cost: where it was evaluated last.
        costs: of each tick there, shape (m,).
        rim: H, g and the cost left where it was linearised last.
        states: all states at the end, shape (m, d).
        calibration: shared values there.
    """

    def __init__(self, ticks: tuple[int, int], d: int, calibration: Calibration, blocks: Sequence[str]):
        self.ticks, self.calibration = ticks, calibration
        self._columns, self.size = rim_columns(d, calibration, blocks)
        self.cost, self.costs = 0.0, np.zeros(ticks[1] - ticks[0] + 1)
        self.rim = (np.zeros((0, 0)), np.zeros(0), 0.0)
        self.states = np.zeros((0, d))

    def columns(self, block: str) -> slice:
        """Columns of a free block."""
        return self._columns[block]

    def damp(self, damping: float, bends: Array | None) -> None:
        """Nothing: the worker is told with the place."""

    def visit(self, ends: Sequence[Array], calibration: Calibration) -> float:
        """What the worker said, which has been asked for this place."""
        return self.cost

    def settle(self) -> tuple[Array, Array, float]:
        """What the worker said, as of `RecordingStretch`."""
        return self.rim
