# SPDX-License-Identifier: BSD-3-Clause
"""Which samples are too far from what was expected to be believed.

A glitch is a sample or a few. A channel that stays far away is no glitch but a jump, or a model that is wrong: it is
believed again, so that no estimate locks itself in.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.window.observation import Observation

Array = NDArray[np.float64]

FAR = 8.0  # [sigma] of the innovation
LONGEST_GLITCH = 0.005  # [s] and
MOST_IN_A_ROW = 5  # samples of a channel that may be refused before it is believed again


Far = dict[tuple[str, int], tuple[float, int]]
"""By sensor and channel: since when it has been far away [s], and for how many samples."""


class OutlierGate:
    """Remembers for each channel since when it has been far away.

    Attributes:
        far: channels that are far away now.
    """

    def __init__(self) -> None:
        self.far: Far = {}

    def believed(self, observations: Sequence[Observation], residual: Array, sigma: Array) -> NDArray[np.bool_]:
        """Rows to use, shape (r,).

        Args:
            observations: in the order of the rows.
            residual: measured - predicted, shape (r,).
            sigma: expected standard deviation of the innovation, shape (r,).
        """
        near = np.abs(residual) < FAR * sigma
        if near.all() and not self.far:
            return near
        keep, row = near.copy(), 0
        for o in observations:
            for channel in o.channels.tolist():
                seat = o.sensor, channel
                if near[row]:
                    self.far.pop(seat, None)
                else:
                    since, count = self.far.get(seat, (o.stamp, 0))
                    self.far[seat] = since, count + 1
                    keep[row] = count >= MOST_IN_A_ROW and o.stamp - since > LONGEST_GLITCH
                row += 1
        return keep
