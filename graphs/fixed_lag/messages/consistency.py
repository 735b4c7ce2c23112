# SPDX-License-Identifier: BSD-3-Clause
"""Whether innovations are as large as the estimator expects: running means of their squares, and alarms.

The normalised square of each channel's innovation has mean 1 if model and noise are right. Its mean over the last
second is held against what chi-square allows for the number of samples in it that are independent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from jointscope.graphs.fixed_lag.window.innovation import Innovation

SECONDS = 1.0  # over which squares are averaged
UPPER = 2.0  # mean square above which there is an alarm; 4 % of wrong noise would not matter, a missing effect is 10
BACK = 1.5  # below which it is over
FEWEST = 50  # samples before a channel can alarm
LARGEST = 1e4  # one sample counts for no more than this
REFUSED = 25.0  # and a refused one for this: a glitch is no alarm, one sample in twenty is
LARGEST_SHARE = 0.1  # of one sample in the mean, after a silence


class Consistency:
    """Running mean squares of innovations.

    Attributes:
        alarms: channels that are out of their bounds now, with their mean square.
    """

    def __init__(self) -> None:
        self.alarms: dict[str, float] = {}
        self._channels: dict[str, _Channel] = {}
        self._nis, self._weight, self._time = 0.0, 0.0, -math.inf

    @property
    def nis_mean(self) -> float:
        """Mean normalised innovation squared per degree of freedom over the last second; NaN before the first."""
        return self._nis / self._weight if self._weight else float("nan")

    @property
    def mean_square(self) -> dict[str, float]:
        """Of the normalised innovations, by channel; 1 is right."""
        return {name: channel.mean_square for name, channel in self._channels.items()}

    def add(self, innovations: Sequence[Innovation]) -> list[tuple[str, float, bool]]:
        """Takes in innovations; returns channels whose alarm begins (True) or ends (False), with their mean square."""
        changed = []
        for innovation in innovations:
            if innovation.used:
                self._add_to_mean(innovation)
            largest = LARGEST if innovation.used else REFUSED
            normalised, time = (innovation.residual / innovation.sigma).tolist(), innovation.time
            for name, z in zip(innovation.channels, normalised, strict=True):
                channel = self._channels.get(name)
                if channel is None:
                    channel = self._channels[name] = _Channel(time)
                elif time > channel.last:
                    share = min((time - channel.last) / SECONDS, LARGEST_SHARE)
                    channel.mean_square += share * (min(z * z, largest) - channel.mean_square)
                    channel.last = time
                channel.count += 1
                mean = channel.mean_square
                if name in self.alarms:
                    self.alarms[name] = mean
                    if mean < BACK:
                        del self.alarms[name]
                        changed.append((name, mean, False))
                elif mean > UPPER and channel.count > FEWEST:
                    self.alarms[name] = mean
                    changed.append((name, mean, True))
        return changed

    def _add_to_mean(self, innovation: Innovation) -> None:
        if innovation.time > self._time:
            decay = math.exp(-(innovation.time - self._time) / SECONDS)
            self._nis, self._weight, self._time = decay * self._nis, decay * self._weight, innovation.time
        self._nis += min(innovation.nis, LARGEST * innovation.dof)
        self._weight += innovation.dof


@dataclass
class _Channel:
    """Running mean of one channel, and the stamp of the sample that last changed it."""

    last: float
    mean_square: float = 1.0
    count: int = 0
