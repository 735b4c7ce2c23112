# SPDX-License-Identifier: BSD-3-Clause
"""Filtered states at all ticks at once: what is known at a tick from data up to that tick only.

The forward half of the banded factorisation is an information filter. With A = L L', w = L^-1 g, and without what
reaches on to later states,

    information  D(k) - D_next(k) - L(k, k-1) L(k, k-1)',   gradient  g(k) - g_next(k) - L(k, k-1) w(k-1)

The first pass linearises around the smoothed states, the second around the filtered ones, so that the future has no
say left in the linearization.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.bag_problem import BagProblem
from jointscope.graphs.banded_solver import eliminate
from jointscope.graphs.normal_equations import build

Array = NDArray[np.float64]

PASSES = 2


@dataclass(frozen=True)
class FilteredStates:
    """Causal estimates.

    Attributes:
        mean: states, shape (m, d).
        covariance: shape (m, d, d).
    """

    mean: Array
    covariance: Array


def filter_states(problem: BagProblem, x: Array, calibration: Calibration) -> FilteredStates:
    """Filters a recording with known shared values.

    Args:
        problem: the factors, with the noise to use.
        x: smoothed states, shape (m, d), for the first linearization.
        calibration: shared values; biases are those of the recording.
    """
    for _ in range(PASSES):
        system = build(problem, x, calibration, split=True)
        assert system.D_next is not None and system.g_next is not None
        elimination = eliminate(system)
        _, L_below = elimination.blocks()
        w = elimination.w.reshape(x.shape)
        information = system.D - system.D_next
        gradient = system.g_x - system.g_next
        information[1:] -= L_below @ L_below.transpose(0, 2, 1)
        gradient[1:] -= (L_below @ w[:-1, :, None])[:, :, 0]
        covariance = _inverse(information)
        x = x - (covariance @ gradient[:, :, None])[:, :, 0]
    return FilteredStates(x, covariance)


def _inverse(information: Array) -> Array:
    """Inverse of symmetric positive matrices whose rows differ by many orders of magnitude."""
    scale = 1.0 / np.sqrt(np.einsum("kii->ki", information))
    scaled = information * scale[:, :, None] * scale[:, None, :]
    inverse = np.linalg.inv(0.5 * (scaled + scaled.transpose(0, 2, 1)))
    return inverse * scale[:, :, None] * scale[:, None, :]
