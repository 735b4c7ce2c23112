# SPDX-License-Identifier: BSD-3-Clause
"""The smoothest way from one motion to another in a given time: the polynomial of degree 7.

Position, velocity, acceleration and jerk are met at both ends. Degree 5 (minimum jerk) would let the jerk leap, which a
link behind a spring cannot: its motor would have to change its velocity at once.
"""

from __future__ import annotations

from math import perm

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DEGREE = 7
POWERS = np.arange(DEGREE + 1)


class Passage:
    """A motion between two moving points, with acceleration and jerk zero at both.

    Args:
        q0, v0: joints at the beginning, shape (n,) [rad], [rad/s].
        q1, v1: joints at the end.
        duration: [s].
    """

    def __init__(self, q0: Array, v0: Array, q1: Array, v1: Array, duration: float):
        self.duration = duration
        zero = np.zeros_like(q0)
        ends = np.array([q0, v0 * duration, zero, zero, q1, v1 * duration, zero, zero])
        rows = np.vstack([_powers(order, np.array([s])) for s in (0.0, 1.0) for order in range(4)])
        self._coefficients = np.linalg.solve(rows, ends)

    def at(self, times: Array, order: int = 0) -> Array:
        """A derivative of the joints' angles, shape (m, n), at times since the beginning, shape (m,) [s]."""
        s = np.clip(np.asarray(times) / self.duration, 0.0, 1.0)
        return _powers(order, s) @ self._coefficients / self.duration**order


def _powers(order: int, s: Array) -> Array:
    """A derivative of 1, s, s^2 ... at s, shape (m, 8)."""
    factors = np.array([perm(power, order) for power in POWERS], dtype=float)
    return factors * s[:, None] ** np.maximum(POWERS - order, 0)
