# SPDX-License-Identifier: BSD-3-Clause
"""What dry friction holds at each rest, beside its band: values with slopes, and rows for normal equations.

What was recorded is the command u, not the torque y = G u + ... that friction holds: its likelihood is that of y times
G. Without this factor a drive that makes less torque would always be likelier, since its band is narrower.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.friction_band import band_cost

Array = NDArray[np.float64]
Rows = tuple[Array, Array, Array]


@dataclass(frozen=True)
class RestBands:
    """Bands of n motors at m rests.

    Attributes:
        y: torque that friction holds less the middle of its band, shape (m, n) [N m].
        half: half width of the band, positive, shape (m, n) [N m].
        y_slopes, half_slopes: their derivatives by positions, (m, n, d), and by shared coordinates, (m, n, p).
        sigma: noise of y and of the band's edges, shape (m, n) [N m].
        counts: 1 where a motor stands after it has moved, 0 where its friction says nothing, shape (m, n).
        log_gain: logarithm of G relative to its prior, shape (n,).
        log_gain_slopes: its derivative by shared coordinates, shape (n, p).
    """

    y: Array
    half: Array
    y_slopes: tuple[Array, Array]
    half_slopes: tuple[Array, Array]
    sigma: Array
    counts: Array
    log_gain: Array
    log_gain_slopes: Array

    def rows(self) -> tuple[Rows, Array]:
        """Rows that have the gradient and the information of the likelihood, and its cost, shape (m,)."""
        found, counts = band_cost(self.y, self.half, self.sigma), self.counts
        rows = []
        for slopes, gradient, information in (
            (self.y_slopes, found.by_torque, found.torque_information),
            (self.half_slopes, found.by_half, found.half_information),
        ):
            J, P = ((counts * np.sqrt(information))[:, :, None] * slope for slope in slopes)
            rows.append((counts * gradient / np.sqrt(information), J, P))
        rows.append((-counts, 0.0 * self.y_slopes[0], counts[:, :, None] * self.log_gain_slopes))
        r, J, P = (np.hstack(part) for part in zip(*rows, strict=True))
        return (r, J, P), np.sum(counts * (found.cost - self.log_gain), axis=1)
