# SPDX-License-Identifier: BSD-3-Clause
"""A standard deviation as a share of its value, in words."""

from __future__ import annotations

import math

KNOWN = 1.0  # share of a value up to which its sigma tells anything about it
NOT_DETERMINED = "not determined"


def relative_sigma(share: float, sign: str = "+-") -> str:
    """As "+-2.1 %", or that a value is not determined where its sigma is larger than the value.

    Args:
        share: standard deviation over the size of the value.
        sign: to stand before it.
    """
    if not math.isfinite(share) or share > KNOWN:
        return NOT_DETERMINED
    return f"{sign}{100 * share:.2g} %"
