# SPDX-License-Identifier: BSD-3-Clause
"""How far an axis must reach for uncertainties, which are far larger in the first moments than ever after."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SETTLING = 0.5  # [s] that are left out
SHARE = 0.2  # of a short recording, at most
AIR = 1.3
NEARLY_ALL = 0.995


def settled_reach(times: Array, values: Array) -> float:
    """Upper limit that shows nearly all values after the beginning.

    Args:
        times: increasing, shape (m,) [s].
        values: not negative, shape (m, ...).

    Returns:
        The limit; zero where there is nothing to show.
    """
    if not len(times):
        return 0.0
    begin = times[0] + min(SETTLING, SHARE * (times[-1] - times[0]))
    shown = values[times >= begin]
    shown = shown[np.isfinite(shown)]
    return AIR * float(np.quantile(shown, NEARLY_ALL)) if shown.size else 0.0
