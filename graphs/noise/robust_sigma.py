# SPDX-License-Identifier: BSD-3-Clause
"""Standard deviations that survive coloured disturbances.

The inverse Hessian is the covariance only where residuals are white. Disturbances that last (a hand on the robot,
friction that changes with temperature) make it too small. A jackknife over blocks of time needs no whiteness within a
block: leaving out block b moves the estimate by

    d_b = (H - H_b)^-1 s_b,      covariance = (B - 1) / B  sum of d_b d_b'

with the block's score s_b and information H_b. Where a few blocks hold most of the information, H_b matters.
Cameron and Miller (2015), "A practitioner's guide to cluster-robust inference", CR3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BLOCK = 0.5  # [s] longer than the memory of the smoother and of most disturbances
FEWEST_BLOCKS = 8  # below this the jackknife says nothing


class BlockScores:
    """Collects scores and information of one recording in blocks of time.

    Args:
        t0, t1: limits of the recording [s].
        indices: global indices of the recording's shared values.
        size: number of all shared values.
        length: of a block [s].
    """

    def __init__(self, t0: float, t1: float, indices: NDArray[np.intp], size: int, length: float = BLOCK):
        self._t0, self._length = t0, length
        self._indices = indices
        self.size = size
        count = max(int(np.ceil((t1 - t0) / length - 1e-9)), 1)
        self._scores = np.zeros((count, len(indices)))
        self._information = np.zeros((count, len(indices), len(indices)))

    def add(self, times: Array, residual: Array, by_shared: Array) -> None:
        """Adds samples in the order of time.

        Args:
            times: shape (m,) [s].
            residual: whitened, shape (m, r).
            by_shared: its derivative by the recording's shared values, states following along, shape (m, r, p).
        """
        block = np.clip(((times - self._t0) / self._length).astype(int), 0, len(self._scores) - 1)
        edges = np.flatnonzero(np.diff(block)) + 1
        for members in np.split(np.arange(len(block)), edges):
            J = by_shared[members].reshape(-1, len(self._indices))
            b = block[members[0]]
            self._scores[b] += J.T @ residual[members].ravel()
            self._information[b] += J.T @ J

    def jackknife(self, H: Array) -> Array:
        """Change of all shared values when each block is left out, shape (blocks, s); H: Hessian, shape (s, s)."""
        score = np.zeros((len(self._scores), self.size))
        information = np.zeros((len(self._scores), self.size, self.size))
        score[:, self._indices] = self._scores
        information[:, self._indices[:, None], self._indices[None, :]] = self._information
        changes = np.linalg.solve(H - information, score[:, :, None])[:, :, 0]
        return np.asarray(changes, dtype=np.float64)


def inflation(scores: list[BlockScores], covariance: Array) -> Array:
    """Block-robust standard deviation over the plain one, at least 1, shape (s,).

    Args:
        scores: of all recordings.
        covariance: inverse Hessian of the shared values, shape (s, s).
    """
    H: Array = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    changes = np.vstack([s.jackknife(H) for s in scores])
    blocks = len(changes)
    if blocks < FEWEST_BLOCKS:
        return np.ones(len(covariance))
    variance = np.sum((changes - changes.mean(axis=0)) ** 2, axis=0) * (blocks - 1.0) / blocks
    return np.sqrt(np.maximum(variance / np.diag(covariance), 1.0))
