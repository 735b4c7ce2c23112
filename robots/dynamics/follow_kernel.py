# SPDX-License-Identifier: BSD-3-Clause
"""From derivatives of torques to derivatives of accelerations, sample by sample."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.compiled import compiled

Array = NDArray[np.float64]


@compiled
def links_follow(M_inverse: Array, by_q: Array, by_v: Array, by_state: Array, by_parameter: Array) -> None:
    """Rows of the links: M^-1 times the derivatives of their torques, plus those of the rigid bodies; in place.

    Args:
        M_inverse: shape (m, n, n).
        by_q: derivative of the bodies' accelerations by the n link positions, which stand first in a state.
        by_v: the same by the velocities, which stand behind them.
        by_state: derivatives of torques, of which the first n rows change, shape (m, r, d).
        by_parameter: the same by parameters, shape (m, r, p).
    """
    m, n, _ = M_inverse.shape
    d, p = by_state.shape[2], by_parameter.shape[2]
    states, parameters = np.empty((n, d)), np.empty((n, p))
    for k in range(m):
        for i in range(n):
            for c in range(d):
                states[i, c] = 0.0
            for c in range(n):
                states[i, c] += by_q[k, i, c]
                states[i, n + c] += by_v[k, i, c]
            for c in range(p):
                parameters[i, c] = 0.0
            for j in range(n):
                x = M_inverse[k, i, j]
                for c in range(d):
                    states[i, c] += x * by_state[k, j, c]
                for c in range(p):
                    parameters[i, c] += x * by_parameter[k, j, c]
        for i in range(n):
            for c in range(d):
                by_state[k, i, c] = states[i, c]
            for c in range(p):
                by_parameter[k, i, c] = parameters[i, c]
