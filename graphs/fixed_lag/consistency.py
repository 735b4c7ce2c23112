# SPDX-License-Identifier: BSD-3-Clause
"""Whether innovations are as large as the estimator expects: running means of their squares, and alarms.

The normalised square of each channel's innovation has mean 1 if model and noise are right. Its mean over the last
second is held against what chi-square allows for the number of samples in it that are independent.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.innovation import Innovation

Array = NDArray[np.float64]

SECONDS = 1.0  # over which squares are averaged
UPPER = 2.0  # mean square above which there is an alarm; 4 % of wrong noise would not matter, a missing effect is 10
BACK = 1.5  # below which it is over
FEWEST = 50  # samples before a channel can alarm
LARGEST = 1e4  # one sample counts for no more than this


class Consistency:
    """Running mean squares of innovations.

    Attributes:
        mean_square: by channel, normalised; 1 is right.
        alarms: channels that are out of their bounds now.
    """

    def __init__(self) -> None:
        self.mean_square: dict[str, float] = {}
        self.alarms: dict[str, float] = {}
        self._count: dict[str, int] = {}
        self._last: dict[str, float] = {}
        self._nis, self._weight, self._time = 0.0, 0.0, 0.0

    @property
    def nis_mean(self) -> float:
        """Mean normalised innovation squared per degree of freedom over the last seconds; NaN before the first."""
        return self._nis / self._weight if self._weight else float("nan")

    def add(self, innovations: Sequence[Innovation]) -> list[tuple[str, bool]]:
        """Takes in innovations; returns the channels whose alarm begins (True) or ends (False)."""
        changed = []
        for innovation in innovations:
            if not innovation.used:
                continue
            self._add_whole(innovation)
            squares = np.minimum((innovation.residual / innovation.sigma) ** 2, LARGEST).tolist()
            for channel, square in zip(innovation.channels, squares, strict=True):
                changed += self._add_channel(channel, innovation.time, square)
        return changed

    def _add_whole(self, innovation: Innovation) -> None:
        decay = np.exp(-max(innovation.time - self._time, 0.0) / SECONDS)
        self._time = max(innovation.time, self._time)
        self._nis = decay * self._nis + min(innovation.nis, LARGEST * innovation.dof)
        self._weight = decay * self._weight + innovation.dof

    def _add_channel(self, channel: str, time: float, square: float) -> list[tuple[str, bool]]:
        count = self._count.get(channel, 0) + 1
        before = self.mean_square.get(channel, 1.0)
        share = min(max(time - self._last.get(channel, time), 0.0) / SECONDS, 1.0)
        mean = before + share * (square - before)
        self.mean_square[channel], self._count[channel], self._last[channel] = mean, count, time
        if channel in self.alarms:
            self.alarms[channel] = mean
            if mean < BACK:
                del self.alarms[channel]
                return [(channel, False)]
        elif mean > UPPER and count > FEWEST:
            self.alarms[channel] = mean
            return [(channel, True)]
        return []
