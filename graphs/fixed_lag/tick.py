# SPDX-License-Identifier: BSD-3-Clause
"""What a listener is told after each update of the estimator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.window.innovation import Innovation


@dataclass(frozen=True)
class Tick:
    """One update: a tick of the command stream with all its messages.

    Attributes:
        state: at the tick.
        innovations: of all samples that went in with it.
        seconds: wall time of the update, mean and covariance included [s].
        smoothed: gives the state at the lag, None until the window is full. It asks GTSAM anew at each call and can be
            called while the listener runs, not later. Its covariance costs a millisecond: `smoothed(covariance=False)`
            leaves it out (NaN).
    """

    state: EstimatedState
    innovations: tuple[Innovation, ...]
    seconds: float
    smoothed: Callable[..., EstimatedState | None]


Listener = Callable[[Tick], None]
