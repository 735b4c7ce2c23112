# SPDX-License-Identifier: BSD-3-Clause
"""Whether two kinds of recordings tell the same values: static against dynamic stiffness, geometry, weights.

In coordinates of unit prior variance a kind of information A has the posterior mean K (true + noise), K = (1 + A)^-1 A.
Means of two kinds with one prior differ by a vector with the covariance

    V = K1 (1 - K1) + K2 (1 - K2) + (K1 - K2) (K1 - K2)'

It is tested in the directions that both tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

Array = NDArray[np.float64]
SHARED = 0.5  # share of a direction that both kinds together must tell
DOUBTFUL = 1e-3  # p-value below which two kinds contradict each other


@dataclass(frozen=True)
class Agreement:
    """Test of two kinds.

    Attributes:
        chi2: squared distance of what they tell in sigmas.
        dof: directions that both tell.
    """

    chi2: float
    dof: int

    @property
    def p_value(self) -> float:
        """Probability of a distance as large, if both kinds see one arm; 1 where they share nothing."""
        return float(chi2.sf(self.chi2, self.dof)) if self.dof else 1.0

    @property
    def doubtful(self) -> bool:
        """Whether they contradict each other."""
        return self.p_value < DOUBTFUL


def agreement(first: tuple[Array, Array], second: tuple[Array, Array]) -> Agreement:
    """Tests two kinds.

    Args:
        first: posterior mean and information of a kind, prior left out, in coordinates of unit prior variance,
            shapes (p,), (p, p).
        second: of the other.
    """
    eye = np.eye(len(first[0]))
    K1, K2 = (np.linalg.solve(eye + A, A) for _, A in (first, second))
    K1, K2 = 0.5 * (K1 + K1.T), 0.5 * (K2 + K2.T)
    V = K1 @ (eye - K1) + K2 @ (eye - K2) + (K1 - K2) @ (K1 - K2).T
    size, U = np.linalg.eigh(K1)
    root = (U * np.sqrt(np.maximum(size, 0.0))) @ U.T
    both, W = np.linalg.eigh(root @ K2 @ root)
    W = root @ W[:, both > SHARED]
    d = W.T @ (first[0] - second[0])
    return Agreement(float(d @ np.linalg.solve(W.T @ V @ W, d)) if len(d) else 0.0, len(d))
