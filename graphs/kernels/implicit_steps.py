# SPDX-License-Identifier: BSD-3-Clause
"""A value with a memory integrated along a motion: dz/dt = f0 + f1 z + f2 z^2, coefficients constant over each step."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]

NO_SLOPE = 1e-9  # of f' times the step, below which the exact solution is that of a constant rate


@compiled
def implicit_steps(h: Array, f0: Array, f1: Array, f2: Array) -> Array:
    """Z at the m + 1 ends of m steps, from zero on; each step solves dz/dt = f(z_k) + f'(z_k) (z - z_k) exactly.

    Args:
        h: lengths of the steps, shape (m,) [s].
        f0: constant part of the rate over each step, shape (m,).
        f1: its linear part.
        f2: its quadratic part.
    """
    z = np.zeros(len(h) + 1)
    for k in range(len(h)):
        now = z[k]
        f, df = f0[k] + f1[k] * now + f2[k] * now * now, f1[k] + 2.0 * f2[k] * now
        z[k + 1] = now + (h[k] * f if abs(df * h[k]) < NO_SLOPE else f * math.expm1(df * h[k]) / df)
    return z
