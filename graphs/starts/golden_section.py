# SPDX-License-Identifier: BSD-3-Clause
"""A minimum over the logarithm of a size by golden section, of a cost that is dear: one evaluation a step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

GOLDEN = 0.6180339887498949


def golden_section(
    cost: Callable[[float], float], smallest: float, largest: float, steps: int
) -> list[tuple[float, float]]:
    """The last two sizes that were tried, each behind its cost; the lower one is the minimum.

    Args:
        cost: of a size.
        smallest: size above which the minimum lies.
        largest: size below which it lies.
        steps: each leaves 62 % of the range of logarithms.
    """
    low, high = np.log(smallest), np.log(largest)
    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    costs = [cost(float(np.exp(x))) for x in inner]
    for _ in range(steps):
        if costs[0] < costs[1]:
            high, inner[1], costs[1] = inner[1], inner[0], costs[0]
            inner[0] = high - GOLDEN * (high - low)
            costs[0] = cost(float(np.exp(inner[0])))
        else:
            low, inner[0], costs[0] = inner[0], inner[1], costs[1]
            inner[1] = low + GOLDEN * (high - low)
            costs[1] = cost(float(np.exp(inner[1])))
    return [(each, float(np.exp(x))) for each, x in zip(costs, inner, strict=True)]
