# SPDX-License-Identifier: BSD-3-Clause
"""Series of which only some samples have a value, such as predictions that end at every tenth tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LONG = 5.0  # [median distance of samples with a value]


def joined(times: Array, values: Array) -> tuple[Array, Array]:
    """The samples that have a value, interrupted only where one is missing for long.

    Args:
        times: shape (m,) [s].
        values: shape (m,); NaN where there is none.

    Returns:
        Times and values; a NaN stands in every long gap.
    """
    good = np.isfinite(values)
    t, y = times[good], values[good]
    if len(t) < 3:
        return t, y
    gaps = np.diff(t)
    after = np.flatnonzero(gaps > LONG * np.median(gaps)) + 1
    return np.insert(t, after, 0.5 * (t[after - 1] + t[after])), np.insert(y, after, np.nan)
