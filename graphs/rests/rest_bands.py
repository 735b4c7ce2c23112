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
SMALLEST_CURVATURE = 1e-4  # of the information on y, where no edge is near


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

    def rows(self, expected: bool = False) -> tuple[Rows, Array]:
        """Rows that have the gradient and the curvature of the likelihood, and its cost, shape (m,).

        Args:
            expected: with the information that a rest gives on average in place of the curvature at these ones.
        """
        found, counts = band_cost(self.y, self.half, self.sigma), self.counts
        yy, yh, hh = found.curvature
        least = SMALLEST_CURVATURE * found.torque_information
        if expected:
            yy, yh, hh = found.torque_information, 0.0 * yh, found.half_information
        else:  # the logarithm of half is steep, not bent: a step by the size of half is right for it
            yy, hh = yy + least, hh + 1.0 / self.half**2
        root = np.sqrt(yy)
        both = yh / root
        rest = np.sqrt(hh - both**2)
        (y_J, y_P), (half_J, half_P) = self.y_slopes, self.half_slopes
        w_y, w_both, w_rest = (counts[:, :, None] * part[:, :, None] for part in (root, both, rest))
        r_y = found.by_torque / root
        rows = [
            (counts * r_y, w_y * y_J + w_both * half_J, w_y * y_P + w_both * half_P),
            (counts * (found.by_half - both * r_y) / rest, w_rest * half_J, w_rest * half_P),
        ]
        rows.append((-counts, 0.0 * self.y_slopes[0], counts[:, :, None] * self.log_gain_slopes))
        r, J, P = (np.hstack(part) for part in zip(*rows, strict=True))
        return (r, J, P), np.sum(counts * (found.cost - self.log_gain), axis=1)
