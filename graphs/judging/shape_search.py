# SPDX-License-Identifier: BSD-3-Clause
"""Shapes between those of a grid: where the score of a hypothesis is largest, one shape after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis

Array = NDArray[np.float64]

ROUNDS, SEARCH, WORTH = 3, 12, 1.0  # passes and evaluations of the search; score that is worth another pass
SAME = 1e-3  # relative difference of shapes that decides nothing


@dataclass(frozen=True)
class Fitted:
    """A hypothesis with its columns, shape (m, k), score, sizes and sigmas, shape (k,)."""

    hypothesis: EffectHypothesis
    columns: Array
    score: float
    sizes: Array
    sigmas: Array


Fit = Callable[[EffectHypothesis], Fitted | None]


def between_shapes(fit: Fit, best: Fitted, hypotheses: Sequence[EffectHypothesis]) -> Fitted:
    """The best of a grid moved to better shapes no farther than its neighbours on the grid.

    Args:
        fit: of one hypothesis.
        best: of those on the grid.
        hypotheses: the grid.
    """
    grids = {name: sorted({h.shapes[name] for h in hypotheses}) for name in best.hypothesis.shapes}
    for _ in range(ROUNDS):
        before = best.score
        for name, grid in grids.items():
            best = _along(fit, best, name, grid)
        if best.score < before + WORTH:
            break
    return best


def _along(fit: Fit, best: Fitted, name: str, grid: Sequence[float]) -> Fitted:
    """The best with another value of one shape."""
    from scipy.optimize import minimize_scalar

    at = best.hypothesis.shapes[name]
    below = max((g for g in grid if g < at * (1.0 - SAME)), default=at)
    above = min((g for g in grid if g > at * (1.0 + SAME)), default=at)
    if not 0.0 < below < above:
        return best
    tried: list[Fitted] = []

    def loss(log: float) -> float:
        found = fit(replace(best.hypothesis, shapes={**best.hypothesis.shapes, name: float(np.exp(log))}))
        assert found is not None
        tried.append(found)
        return -found.score

    bounds = (np.log(below), np.log(above))
    minimize_scalar(loss, bounds=bounds, method="bounded", options={"maxiter": SEARCH, "xatol": SAME})
    return max([best, *tried], key=lambda found: found.score)
