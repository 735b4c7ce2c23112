# SPDX-License-Identifier: BSD-3-Clause
"""Whether innovations are as large as the estimator expects: running means of their squares, and alarms.

The normalised square of each channel's innovation has mean 1 if model and noise are right. Its mean over the last
second is held against what chi-square allows for the number of samples in it that are independent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from jointscope.graphs.fixed_lag.innovation import Innovation

SECONDS = 1.0  # over which squares are averaged
UPPER = 2.0  # mean square above which there is an alarm; 4 % of wrong noise would not matter, a missing effect is 10
BACK = 1.5  # below which it is over
FEWEST = 50  # samples before a channel can alarm
LARGEST = 1e4  # one sample counts for no more than this


class Consistency:
    """Running mean squares of innovations.

    Attributes:
        alarms: channels that are out of their bounds now, with their mean square.
    """

    def __init__(self) -> None:
        self.alarms: dict[str, float] = {}
        self._groups: dict[tuple[str, ...], _Group] = {}
        self._nis, self._weight, self._time = 0.0, 0.0, -math.inf

    @property
    def nis_mean(self) -> float:
        """Mean normalised innovation squared per degree of freedom over the last second; NaN before the first."""
        return self._nis / self._weight if self._weight else float("nan")

    @property
    def mean_square(self) -> dict[str, float]:
        """Of the normalised innovations, by channel; 1 is right."""
        found: dict[str, float] = {}
        for channels, group in self._groups.items():
            found |= dict(zip(channels, group.mean_square, strict=True))
        return found

    def add(self, innovations: Sequence[Innovation]) -> list[tuple[str, float, bool]]:
        """Takes in innovations; returns channels whose alarm begins (True) or ends (False), with their mean square."""
        changed = []
        for innovation in innovations:
            if not innovation.used:
                continue
            if innovation.time > self._time:
                decay = math.exp(-(innovation.time - self._time) / SECONDS)
                self._nis, self._weight, self._time = decay * self._nis, decay * self._weight, innovation.time
            self._nis += min(innovation.nis, LARGEST * innovation.dof)
            self._weight += innovation.dof
            group = self._groups.get(innovation.channels)
            if group is None:
                group = self._groups[innovation.channels] = _Group(innovation)
            group.add(innovation)
            if group.count > FEWEST and (self.alarms or max(group.mean_square) > UPPER):
                changed += self._crossed(innovation.channels, group)
        return changed

    def _crossed(self, channels: tuple[str, ...], group: _Group) -> list[tuple[str, float, bool]]:
        changed = []
        for channel, mean in zip(channels, group.mean_square, strict=True):
            if channel in self.alarms:
                self.alarms[channel] = mean
                if mean < BACK:
                    del self.alarms[channel]
                    changed.append((channel, mean, False))
            elif mean > UPPER:
                self.alarms[channel] = mean
                changed.append((channel, mean, True))
        return changed


class _Group:
    """Channels that are always sampled together."""

    def __init__(self, first: Innovation):
        self.mean_square, self.count, self._last = [1.0] * first.dof, 0, first.time

    def add(self, innovation: Innovation) -> None:
        share = min(max(innovation.time - self._last, 0.0) / SECONDS, 1.0)
        normalised = (innovation.residual / innovation.sigma).tolist()
        self.mean_square = [
            mean + share * (min(z * z, LARGEST) - mean) for mean, z in zip(self.mean_square, normalised, strict=True)
        ]
        self.count += 1
        self._last = max(innovation.time, self._last)
