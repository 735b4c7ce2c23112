# SPDX-License-Identifier: BSD-3-Clause
"""Are prediction errors white? A model that lacks nothing leaves errors that say nothing about the next ones.

Errors of predictions h seconds ahead are uncorrelated only if the predictions do not overlap, so they must be taken h
apart. The test is that of Ljung and Box in the form that allows errors to be large at one time and small at another
(Lobato, Nankervis, Savin 2001): with e_i the errors,

    t_j = sum_i e_i e_{i+j} / sqrt(sum_i e_i^2 e_{i+j}^2),    Q = sum_j t_j^2 ~ chi^2 with as many degrees as lags.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

Array = NDArray[np.float64]

LAGS = 10  # at most; 0.1 s of predictions 0.01 s ahead
FEWEST = 30  # errors per lag that make the chi-square distribution hold
MISPLACED = 0.1  # spacings that an error may lie beside its grid point


@dataclass(frozen=True)
class Whiteness:
    """Result of the test.

    Attributes:
        autocorrelation: at lag one; NaN where there are too few errors.
        p: probability that white errors look at least as coloured; NaN where there are too few errors.
    """

    autocorrelation: float
    p: float


def whiteness(errors: Array) -> Whiteness:
    """Tests evenly spaced errors.

    Args:
        errors: shape (m,); NaN where there is none, so that distances in time stay true.
    """
    known = np.isfinite(errors)
    count = int(np.sum(known))
    lags = min(LAGS, count // FEWEST)
    if lags < 1:
        return Whiteness(float("nan"), float("nan"))
    e = np.where(known, errors - np.mean(errors[known]), 0.0)
    products = [e[:-j] * e[j:] for j in range(1, lags + 1)]
    spread = np.array([np.sum(product**2) for product in products])
    sums = np.array([np.sum(product) for product in products])
    power = float(np.sum(e**2))
    if power == 0.0 or np.any(spread == 0.0):
        return Whiteness(float("nan"), float("nan"))
    Q = float(np.sum(sums**2 / spread))
    return Whiteness(float(sums[0]) / power, float(chdtrc(lags, Q)))


def evenly(times: Array, errors: Array, spacing: float) -> Array:
    """Errors on a grid of time, NaN where none lies.

    Args:
        times: increasing, shape (m,) [s].
        errors: shape (m,).
        spacing: of the grid [s].
    """
    if not len(times):
        return errors
    place = (times - times[0]) / spacing
    slot = np.rint(place).astype(int)
    off = np.abs(place - slot)
    order = np.argsort(-off)[np.sum(off > MISPLACED) :]  # nearest last, so that it stays
    grid = np.full(slot[-1] + 1, np.nan)
    grid[slot[order]] = errors[order]
    return grid
