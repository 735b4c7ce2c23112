# SPDX-License-Identifier: BSD-3-Clause
"""The ticks in the window, with all that is needed to take the steps between them anew."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.window.newest_state import NewestState
from jointscope.graphs.fixed_lag.window.observation import Observation
from jointscope.graphs.fixed_lag.window.outlier_gate import Far

Array = NDArray[np.float64]


@dataclass
class PastTick:
    """A tick in the window.

    Attributes:
        number: of the tick.
        time: [s].
        observations: samples of the step that led here, those taken for glitches included.
        nominal: state from which deviations count, shape (D,).
        filtered: the state here when it was the newest.
        u: mean command of the step that led here, shape (n,).
        slots: of the factors of the step that led here.
        glitches: sensor of each sample of it that was taken for a glitch.
        far: channels that had been far away when the tick was closed.
    """

    number: int
    time: float
    observations: tuple[Observation, ...]
    nominal: Array
    filtered: NewestState
    u: Array
    slots: list[int] = field(default_factory=list)
    glitches: tuple[str, ...] = ()
    far: Far = field(default_factory=dict)
