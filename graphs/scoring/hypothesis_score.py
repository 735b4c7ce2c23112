# SPDX-License-Identifier: BSD-3-Clause
"""What the score test says of a hypothesis, alone and beside others."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis

Array = NDArray[np.float64]

INDEPENDENT = 0.1  # [s] stretches of this length count as samples where sizes are paid for
DETERMINED = 0.5  # [prior sigma] a size known better than this is determined by the recordings


@dataclass(frozen=True)
class HypothesisScore:
    """What the recordings say about one hypothesis without a refit.

    Attributes:
        hypothesis: effect, owner, shapes.
        score: s' S^-1 s.
        estimate: of the sizes, shape (k,).
        sigma: their standard deviations, shape (k,).
        S, s: profiled Hessian and gradient of the sizes, shape (k, k) and (k,).
    """

    hypothesis: EffectHypothesis
    score: float
    estimate: Array
    sigma: Array
    S: Array
    s: Array

    @property
    def dof(self) -> int:
        """Number of plausible sizes that the recordings determine; gauges are held by their prior alone."""
        prior = np.array([size.prior_sigma for size in self.hypothesis.sizes])
        determined = self.sigma < DETERMINED * prior
        return max(int(np.sum(determined[list(self.plausible[1])])), 1)

    def worth(self, seconds: float) -> float:
        """Plausible score less what its sizes cost, dof log samples, in recordings of a length [s]."""
        return float(self.plausible[0] - self.dof * np.log(seconds / INDEPENDENT))

    @cached_property
    def plausible(self) -> tuple[float, tuple[int, ...]]:
        """Largest score of sizes that all have a possible sign, and which those are; (0, ()) if there are none."""
        signed = [i for i, size in enumerate(self.hypothesis.sizes) if size.sign == "+"]
        count = len(self.estimate)
        if all(self.estimate[i] > 0 for i in signed):
            return self.score, tuple(range(count))
        best: tuple[float, tuple[int, ...]] = (0.0, ())
        for size in range(count - 1, 0, -1):
            for kept in combinations(range(count), size):
                estimate, value = fit(self.S[np.ix_(kept, kept)], self.s[list(kept)])
                if all(estimate[kept.index(i)] > 0 for i in signed if i in kept):
                    best = max(best, (value, kept))
        return best


@dataclass(frozen=True)
class JointScores:
    """Hypotheses scored together.

    Attributes:
        scores: one per hypothesis.
        p_values: block-robust, shape (hypotheses,).
        S: profiled Hessian of all sizes, shape (k, k).
        s: profiled gradient, shape (k,).
        columns: sizes of each hypothesis among the k.
    """

    scores: list[HypothesisScore]
    p_values: Array
    S: Array
    s: Array
    columns: list[slice]

    def correlation(self, a: int, b: int) -> float:
        """Largest correlation between what two hypotheses can explain, 0 to 1."""
        S = self.S
        A, B = self.columns[a], self.columns[b]
        Q_a, Q_b = (np.linalg.pinv(_root(S[c, c])) for c in (A, B))
        return float(np.linalg.svd(Q_a.T @ S[A, B] @ Q_b, compute_uv=False)[0])


@dataclass(frozen=True)
class HypothesisStep:
    """One linear step with a hypothesis.

    Attributes:
        hypothesis: effect, owner, shapes.
        sizes: found, shape (k,).
        sigmas: their standard deviations, those from blocks where these scatter more, shape (k,).
        response: of the shared values to each size, shape (shared, k).
        p_value: block-robust.
        covariances: of the sizes, by white noise and by the scatter of blocks, shape (2, k, k).
    """

    hypothesis: EffectHypothesis
    sizes: Array
    sigmas: Array
    response: Array
    p_value: float
    covariances: Array


def best_shapes(scores: Iterable[HypothesisScore]) -> dict[str, HypothesisScore]:
    """The best score of each label, of all the shapes that were tried."""
    best: dict[str, HypothesisScore] = {}
    for score in scores:
        label = score.hypothesis.label
        if label not in best or score.plausible[0] > best[label].plausible[0]:
            best[label] = score
    return best


def fit(S: Array, s: Array) -> tuple[Array, float]:
    """Estimate and score of some sizes."""
    estimate = -np.linalg.pinv(S, rcond=1e-12, hermitian=True) @ s
    return estimate, float(-estimate @ s)


def _root(S: Array) -> Array:
    """Symmetric square root."""
    values, vectors = np.linalg.eigh(S)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T, dtype=np.float64)
