# SPDX-License-Identifier: BSD-3-Clause
"""Standard deviations that survive coloured disturbances.

The inverse Hessian is the covariance only where residuals are white. Disturbances that last (friction changing with
temperature, a hand on the robot) make it too small. The sandwich  H^-1 (sum of s_b s_b') H^-1  over blocks of time
needs no whiteness within a block; s_b is the score of block b. White and Domowitz (1984), Newey and West (1987).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BLOCK = 0.5  # [s] longer than the memory of the smoother and of most disturbances
FEWEST_BLOCKS = 8  # below this the sandwich says nothing


class BlockScores:
    """Collects scores of one recording in blocks of time.

    Args:
        t0, t1: limits of the recording [s].
        indices: global indices of the recording's shared values.
        size: number of all shared values.
    """

    def __init__(self, t0: float, t1: float, indices: NDArray[np.intp], size: int):
        self._t0 = t0
        count = max(int(np.ceil((t1 - t0) / BLOCK)), 1)
        self.scores = np.zeros((count, size))
        self._indices = indices

    def add(self, times: Array, score: Array) -> None:
        """Adds the scores of samples, shape (m, p), at their times, shape (m,) [s]."""
        block = np.clip(((times - self._t0) / BLOCK).astype(int), 0, len(self.scores) - 1)
        for j, index in enumerate(self._indices):
            self.scores[:, index] += np.bincount(block, weights=score[:, j], minlength=len(self.scores))


def inflation(scores: list[BlockScores], covariance: Array) -> Array:
    """Block-robust standard deviation over the plain one, at least 1, shape (s,).

    Args:
        scores: of all recordings.
        covariance: inverse Hessian of the shared values, shape (s, s).
    """
    stacked = np.vstack([s.scores for s in scores])
    blocks = len(stacked)
    if blocks < FEWEST_BLOCKS:
        return np.ones(len(covariance))
    centred = (stacked - stacked.mean(axis=0)) @ covariance
    robust = np.sum(centred**2, axis=0) * blocks / (blocks - 1.0)
    return np.sqrt(np.maximum(robust / np.diag(covariance), 1.0))
