# SPDX-License-Identifier: BSD-3-Clause
"""Encoders whose counter begins anew after a turn or an overflow: continued where the period is known, else noticed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WHOLE_RANGE = 0.75  # share of a channel's range that no motion covers from one sample to the next
GAP = 3.0  # median periods beyond which two samples are no neighbours


def continued(values: Array, period: float, before: Array | None = None) -> Array:
    """A counter without its jumps.

    Args:
        values: samples, shape (n, m); those that are not finite stay as they are.
        period: after which it begins anew [unit of the values].
        before: last continued samples of the same counter, shape (m,); None at its beginning.
    """
    found = values.copy()
    for j, column in enumerate(values.T):
        good = np.isfinite(column)
        if not good.any():
            continue
        start = [] if before is None or not np.isfinite(before[j]) else [before[j]]
        found[good, j] = np.unwrap(np.concatenate([start, column[good]]), period=period)[len(start) :]
    return found


def wrapping_jump(times: Array, column: Array) -> float:
    """Size of the largest jump between neighbours that covers nearly the whole range; 0 where there is none.

    Args:
        times: shape (n,) [s].
        column: one channel, shape (n,).
    """
    good = np.isfinite(column)
    times, column = times[good], column[good]
    if len(column) < 3:
        return 0.0
    steps, span = np.diff(column), float(np.ptp(column))
    near = np.diff(times) < GAP * float(np.median(np.diff(times)))
    largest = float(np.max(np.abs(steps[near]), initial=0.0))
    return largest if span > 0.0 and largest > WHOLE_RANGE * span else 0.0
