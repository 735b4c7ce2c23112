# SPDX-License-Identifier: BSD-3-Clause
"""Mean and covariance of a density in a few dimensions, whatever its shape, by walkers that move towards each other.

    z_k' = z_j + t (z_k - z_j),   p(t) ~ 1 / sqrt(t) on [1/2, 2]
    taken with probability min(1, t^(r-1) p(z_k') / p(z_k))

A move is along a line through another walker, so that no step size has to fit the density. Source: Goodman and Weare,
"Ensemble samplers with affine invariance", Comm. App. Math. Comp. Sci. 5 (2010), eq. (7) and (9).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BURN_IN, ROUNDS = 300, 1000  # moves of all walkers, before and while moments are taken
STRETCH = 2.0


def moments(cost: Callable[[Array], Array], walkers: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Mean, shape (r,), and covariance, shape (r, r), of exp(-cost).

    Args:
        cost: of points of shape (k, r); infinite where there is no density.
        walkers: where they begin, at points of finite cost, an even number of them, shape (w, r).
        rng: draws the moves.
    """
    walkers, costs, r = walkers.copy(), cost(walkers), walkers.shape[1]
    halves = np.split(np.arange(len(walkers)), 2)
    seen = []
    for k in range(BURN_IN + ROUNDS):
        for own, others in (halves, halves[::-1]):
            stretch = ((STRETCH - 1.0) * rng.random(len(own)) + 1.0) ** 2 / STRETCH
            other = walkers[rng.choice(others, len(own))]
            tried = other + stretch[:, None] * (walkers[own] - other)
            there = cost(tried)
            taken = np.log(rng.random(len(own))) < (r - 1.0) * np.log(stretch) + costs[own] - there
            walkers[own[taken]], costs[own[taken]] = tried[taken], there[taken]
        if k >= BURN_IN:
            seen.append(walkers.copy())
    points = np.concatenate(seen)
    return points.mean(axis=0), np.cov(points.T).reshape(r, r)
