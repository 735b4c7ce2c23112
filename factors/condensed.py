# SPDX-License-Identifier: BSD-3-Clause
"""A whole stretch of motion as one `gtsam.CustomFactor`: its inner states are eliminated before GTSAM sees it.

Variables: X(a) and X(b), the states at the two ends of the stretch, and the blocks of shared values that may change. A
recording of another kind than motion has no ends: it is a factor on its blocks alone.
With H and g the Gauss-Newton system that the eliminated stretch leaves on these variables, the factor's rows are a
square root of it,

    J' J = H,    J' r = g,    |r|^2 / 2 = cost that the stretch keeps when its inner states follow,

so GTSAM linearises, eliminates and retracts as if all samples were its own. Without derivatives the factor tells the
true cost: at new ends and shared values the inner states follow as the last linearisation says, and everything is
evaluated there. A call with derivatives makes that point the one from which the inner states follow next.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.single import block_key, extract_calibration, state_key

Array = NDArray[np.float64]

NOTHING = 1e-15  # of the largest eigenvalue; directions below are not determined by the stretch


class Stretch(Protocol):
    """Many samples between two states, or without; it remembers where it was linearised and where it was tried."""

    @property
    def ticks(self) -> tuple[int, ...]:
        """First and last tick, or none."""

    @property
    def size(self) -> int:
        """Number of columns: both ends, then the free blocks."""

    def columns(self, block: str) -> slice:
        """Columns of a free block."""

    def visit(self, ends: Sequence[Array], calibration: Calibration) -> float:
        """Evaluates everything at new ends and shared values; returns the cost there."""

    def settle(self) -> tuple[Array, Array, float]:
        """Makes the visited point the linearisation point: H, shape (n, n), g, shape (n,), and the cost left."""


class CondensedFactor:
    """GTSAM's view of a stretch.

    Args:
        stretch: the samples.
        piece: number of the chain of states that it is a part of.
        owner: recording whose biases it sees.
        blocks: names of the shared blocks that may change.
        like: any calibration of the robot; gives the layout of the blocks and the values of those that are held.
    """

    def __init__(self, stretch: Stretch, piece: int, owner: int, blocks: Sequence[str], like: Calibration):
        self.stretch = stretch
        self.blocks = tuple(blocks)
        self._owner, self._like = owner, like
        self._ends = [state_key(tick, piece) for tick in stretch.ticks]
        self.keys = [*self._ends, *(block_key(block, like, owner) for block in self.blocks)]

    def factor(self) -> gtsam.CustomFactor:
        """The factor to put into a graph."""
        return gtsam.CustomFactor(gtsam.noiseModel.Unit.Create(self.stretch.size + 1), self.keys, self._evaluate)

    def _evaluate(self, this: gtsam.CustomFactor, values: gtsam.Values, H: list | None) -> Array:
        ends = [values.atVector(key) for key in self._ends]
        calibration = extract_calibration(values, self._like, self.blocks, self._owner)
        cost = self.stretch.visit(ends, calibration)
        rows = np.zeros(self.stretch.size + 1)
        if H is None:
            rows[-1] = np.sqrt(2.0 * cost)
            return rows
        J, rows = _square_root(*self.stretch.settle())
        for i, end in enumerate(ends):
            H[i] = np.asfortranarray(J[:, i * len(end) : (i + 1) * len(end)])
        for i, block in enumerate(self.blocks, len(ends)):
            H[i] = np.asfortranarray(J[:, self.stretch.columns(block)])
        return rows


def _square_root(H: Array, g: Array, cost: float) -> tuple[Array, Array]:
    """J, shape (n + 1, n), and r, shape (n + 1,), with J' J = H, J' r = g, |r|^2 = 2 cost.

    By eigenvalues of the scaled matrix: a stretch alone need not determine all of its variables.
    """
    n = len(g)
    J, r = np.zeros((n + 1, n)), np.zeros(n + 1)
    if not (np.all(np.isfinite(H)) and np.all(np.isfinite(g))):
        return np.full_like(J, np.nan), np.full_like(r, np.nan)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    values, vectors = np.linalg.eigh(H * scale[:, None] * scale)
    told = values > NOTHING * values[-1]
    roots = np.sqrt(values[told])
    J[: len(roots)] = roots[:, None] * vectors[:, told].T / scale
    r[: len(roots)] = (vectors[:, told].T @ (g * scale)) / roots
    r[-1] = np.sqrt(max(2.0 * cost - float(r @ r), 0.0))
    return J, r
