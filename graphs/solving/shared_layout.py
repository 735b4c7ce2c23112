# SPDX-License-Identifier: BSD-3-Clause
"""Where the shared values of several recordings stand in one vector.

First what recordings share (dynamics, rotations, ...), block after block as the recordings name them, then what each
recording has for itself: (dynamics, rotations, biases of bag 0, biases of bag 1, ...). Recordings of different kinds
need not have the same blocks. A recording may come in pieces; they share its own blocks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.block import Block
from jointscope.factors.calibration import Calibration

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SharedLayout:
    """Places of every recording's shared values in the global vector.

    Attributes:
        places: place of each block of each piece, in the order of the piece's own blocks.
        owners: recording that each piece belongs to, 0, 1, ...; a recording given whole is one piece.
        size: length of the global vector.
    """

    places: tuple[Mapping[str, slice], ...]
    owners: tuple[int, ...]
    size: int

    @staticmethod
    def of(calibrations: Calibration | Sequence[Calibration], owners: int | Sequence[int]) -> SharedLayout:
        """The layout of some recordings.

        Args:
            calibrations: shared values of each piece; of any one where all have the same blocks.
            owners: recording of each piece, or the number of recordings that are given whole.
        """
        pieces = tuple(range(owners)) if isinstance(owners, int) else tuple(owners)
        each = [calibrations] * len(pieces) if isinstance(calibrations, Calibration) else list(calibrations)
        found: dict[tuple[str, int], slice] = {}
        size = 0
        for own in (False, True):
            for calibration, owner in sorted(zip(each, pieces, strict=True), key=lambda pair: own * pair[1]):
                for block in calibration.layout.values():
                    if block.own is own and _identity(block, owner) not in found:
                        found[_identity(block, owner)] = slice(size, size + block.size)
                        size += block.size
        places = tuple(
            {block.name: found[_identity(block, owner)] for block in calibration.layout.values()}
            for calibration, owner in zip(each, pieces, strict=True)
        )
        return SharedLayout(places, pieces, size)

    @property
    def columns(self) -> Mapping[str, slice]:
        """Places of each block as the first recording that has it sees it."""
        found: dict[str, slice] = {}
        for places in self.places:
            for block, place in places.items():
                found.setdefault(block, place)
        return found

    @property
    def bags(self) -> int:
        """Number of recordings."""
        return max(self.owners) + 1

    def indices(self, piece: int) -> NDArray[np.intp]:
        """Global indices of the values of a piece, in the order of its blocks."""
        return np.concatenate(
            [np.arange(place.start, place.stop) for place in self.places[piece].values()] or [np.zeros(0, np.intp)]
        )

    def step(self, dp: Array, piece: int) -> dict[str, Array]:
        """The part of a global step that concerns a piece, block by block."""
        return {block: dp[place] for block, place in self.places[piece].items()}


def _identity(block: Block, owner: int) -> tuple[str, int]:
    return block.name, owner if block.own else -1
