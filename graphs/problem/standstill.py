# SPDX-License-Identifier: BSD-3-Clause
"""Where a joint sticks dry friction takes any value of its band: its equation of motion tells nothing there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SATURATED = 3.0  # tanh of this is 1 to half a percent: dry friction is a sign from here on
SLOW = 1e-3  # of the 95 % speed
LOOK = 0.02  # [s] over which a speed is measured
RESOLVED = 3.0  # [sigma] of such a speed
LASTING = 0.05  # [s] a joint that is slow for less time turns over
EDGE = 0.003  # [s] around a standstill


def slowest_speed(v: Array, sharpness: float) -> float:
    """Speed below which friction is not known [rad/s, m/s]; v of shape (m,)."""
    return max(SATURATED / sharpness, SLOW * float(np.quantile(np.abs(v), 0.95)))


def lasting(mask: Mask, steps: int) -> Mask:
    """Those runs of a mask that last at least a number of steps, shape (m,)."""
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False].astype(int)))
    found = np.zeros_like(mask)
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        found[first:last] = last - first >= steps
    return found


def near(mask: Mask, steps: int) -> Mask:
    """A mask widened by a number of steps on both sides, shape (m,)."""
    if steps < 1:
        return mask
    return np.asarray(np.convolve(mask.astype(float), np.ones(2 * steps + 1), mode="same") > 0.5)
