# SPDX-License-Identifier: BSD-3-Clause
"""Where a joint sticks dry friction takes any value of its band: its equation of motion tells nothing there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SATURATED = 3.0  # tanh of this is 1 to half a percent: dry friction is a sign from here on
SLOW = 1e-3  # of the 95 % speed


def slowest_speed(v: Array, sharpness: float) -> float:
    """Speed below which friction is not known [rad/s, m/s]; v of shape (m,)."""
    return max(SATURATED / sharpness, SLOW * float(np.quantile(np.abs(v), 0.95)))


def near(mask: Mask, steps: int) -> Mask:
    """A mask widened by a number of steps on both sides, shape (m,)."""
    if steps < 1:
        return mask
    return np.asarray(np.convolve(mask.astype(float), np.ones(2 * steps + 1), mode="same") > 0.5)
