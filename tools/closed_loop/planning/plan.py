# SPDX-License-Identifier: BSD-3-Clause
"""What the links shall do: a motion at the ticks, and the hits in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hit:
    """The head shall be at a place with a velocity at a time, and then come home.

    Attributes:
        start: when the links leave home [s].
        time: of the hit [s].
        back: when they are home again [s].
        end: until when they stay there [s].
        q, v: joints at the hit, shape (n_joints,) [rad], [rad/s].
    """

    start: float
    time: float
    back: float
    end: float
    q: Array
    v: Array


@dataclass(frozen=True)
class Plan:
    """A planned motion of the links.

    Attributes:
        times: of the ticks, shape (m,) [s].
        q, v, a: angles, velocities and accelerations of the links, each of shape (m, n_joints) [rad], [rad/s],
            [rad/s^2].
        home: where they rest, shape (n_joints,) [rad].
        hits: in the order of time.
    """

    times: Array
    q: Array
    v: Array
    a: Array
    home: Array
    hits: tuple[Hit, ...]

    @property
    def count(self) -> str:
        """How many hits, in words."""
        return "1 hit" if len(self.hits) == 1 else f"{len(self.hits)} hits"

    def tick(self, time: float) -> int:
        """The tick nearest to a time [s]."""
        step = self.times[1] - self.times[0]
        return int(np.clip(round((time - self.times[0]) / step), 0, len(self.times) - 1))
