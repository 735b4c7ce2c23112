# SPDX-License-Identifier: BSD-3-Clause
"""Mean and covariance of a density in a few dimensions, whatever its shape, by walkers that move towards each other.

    z_k' = z_j + t (z_k - z_j),   p(t) ~ 1 / sqrt(t) on [1/2, 2]
    taken with probability min(1, t^(r-1) p(z_k') / p(z_k))

A move is along a line through another walker, so that no step size has to fit the density. Source: Goodman and Weare,
"Ensemble samplers with affine invariance", Comm. App. Math. Comp. Sci. 5 (2010), eq. (7) and (9).

A band that few rests tell has a long tail, beyond a stretch in which hardly a walker lives: those of one ensemble stay
where they began for ten thousands of moves, and sigmas come out by half too small. So more ensembles walk on flatter
densities, p^(1/T), and walkers of neighbours change places with probability min(1, (p(z_b) / p(z_a))^(1/T_a - 1/T_b)).
Source: Geyer, "Markov chain Monte Carlo maximum likelihood", Proc. 23rd Symp. Interface (1991).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BURN_IN, ROUNDS = 300, 1000  # moves of all walkers, before and while moments are taken
STRETCH = 2.0
FLATTER = (1.0, 2.0, 4.0)  # T of each ensemble; the first one counts


def moments(cost: Callable[[Array], Array], walkers: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Mean, shape (r,), and covariance, shape (r, r), of exp(-cost).

    Args:
        cost: of points of shape (k, r); infinite where there is no density.
        walkers: where they begin, at points of finite cost, an even number of them, shape (w, r).
        rng: draws the moves.
    """
    (w, r), count = walkers.shape, len(FLATTER)
    points = np.tile(walkers, (count, 1))
    costs = cost(points)
    T = np.repeat(FLATTER, w)
    places = np.arange(count * w).reshape(count, w)
    halves = places[:, : w // 2], places[:, w // 2 :]
    seen = []
    for k in range(BURN_IN + ROUNDS):
        for own, others in (halves, halves[::-1]):
            mine, size = own.ravel(), own.size
            stretch = ((STRETCH - 1.0) * rng.random(size) + 1.0) ** 2 / STRETCH
            other = points[np.take_along_axis(others, rng.integers(0, w // 2, own.shape), axis=1).ravel()]
            tried = other + stretch[:, None] * (points[mine] - other)
            there = cost(tried)
            taken = np.log(rng.random(size)) < (r - 1.0) * np.log(stretch) + (costs[mine] - there) / T[mine]
            points[mine[taken]], costs[mine[taken]] = tried[taken], there[taken]
        for i in range(count - 1):
            a, b = places[i], rng.permutation(places[i + 1])
            flatter = 1.0 / FLATTER[i] - 1.0 / FLATTER[i + 1]
            changed = np.log(rng.random(w)) < flatter * (costs[a] - costs[b])
            a, b = a[changed], b[changed]
            points[a], points[b] = points[b], points[a]
            costs[a], costs[b] = costs[b], costs[a]
        if k >= BURN_IN:
            seen.append(points[:w].copy())
    found = np.concatenate(seen)
    return found.mean(axis=0), np.cov(found.T).reshape(r, r)
