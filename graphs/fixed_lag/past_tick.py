# SPDX-License-Identifier: BSD-3-Clause
"""The ticks in the window and the steps between them, kept for what comes late."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.tick_step import TickStep

Array = NDArray[np.float64]


@dataclass
class PastStep:
    """A step that may be weighed anew when commands come late.

    Attributes:
        start: state in which it was linearised, shape (D,).
        h: length [s].
        u: mean command, shape (n,).
        step: its linearization.
        by_parameters: change of its end per adapted parameter, before the dynamics of the end, shape (d, p).
        moved: how the defect has changed by other commands since, shape (d,).
    """

    start: Array
    h: float
    u: Array
    step: TickStep
    by_parameters: Array
    moved: Array


@dataclass
class PastTick:
    """A tick in the window.

    Attributes:
        number: of the tick.
        time: [s].
        nominal: state from which deviations count, shape (D,).
        slot: of the factor of the step that led here; -1 for the first tick.
        step: that led here; None for the first tick.
    """

    number: int
    time: float
    nominal: Array
    slot: int = -1
    step: PastStep | None = None
