# SPDX-License-Identifier: BSD-3-Clause
"""Orders (periods per turn of a joint) at which the difference of its encoders repeats with the position.

Teeth of a gear and disks of encoders leave a ripple whose order nobody knows beforehand. The periodogram of what a
model leaves, over the position instead of time, has a peak there. Only a search, on the seconds that are fitted: those
between decide.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.transmission.free_links import EquationRows
from jointscope.graphs.transmission.linear_equations import SECOND

Array = NDArray[np.float64]

FEWEST_PERIODS = 3.0  # over the range of positions; slower changes are no ripple
LARGEST_ORDER = 1000.0
LARGEST_PHASE = 1.5  # [rad] from one sample to the next in ordinary motion; beyond, the samples are too sparse
POINTS = 8.0  # of the periodogram per independent order


def strongest_order(rows: Sequence[EquationRows], joint: str) -> float | None:
    """Where the periodogram of what is left of a joint's gear equation is largest; None where no order can be seen.

    Args:
        rows: all equations of all recordings.
        joint: whose ripple.
    """
    own = [(r, r.equation.position) for r in rows if r.equation.name == f"{joint}.gear"]
    fitted = [np.floor(r.equation.times / SECOND).astype(int) % 2 == 0 for r, _ in own]
    left = np.concatenate([_centred(r.residual[f, 0]) for (r, _), f in zip(own, fitted, strict=True)])
    q = np.concatenate([q[f] for (_, q), f in zip(own, fitted, strict=True) if q is not None])
    if not len(q):
        return None
    span, step = float(np.ptp(q)), max(_usual_step(q) for _, q in own if q is not None)
    lowest = FEWEST_PERIODS * 2.0 * np.pi / max(span, 1e-9)
    highest = min(LARGEST_ORDER, LARGEST_PHASE / max(step, 1e-9))
    if lowest >= highest:
        return None
    orders = np.arange(lowest, highest, 2.0 * np.pi / span / POINTS)
    power = np.array([abs(np.dot(left, np.exp(1j * order * q))) for order in orders])
    return float(orders[int(np.argmax(power))])


def _centred(values: Array) -> Array:
    return values - values.mean() if len(values) else values


def _usual_step(q: Array) -> float:
    """Change of the position from one sample to the next while the joint moves."""
    steps = np.abs(np.diff(q))
    moving = steps[steps > 0.1 * float(np.max(steps, initial=0.0))]
    return float(np.median(moving)) if len(moving) else 0.0
