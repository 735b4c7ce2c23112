# SPDX-License-Identifier: BSD-3-Clause
"""What hangs on an arm, and when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LoadHistory:
    """A known force on the arm over time; each holds until the next, and before the first nothing hangs there.

    Attributes:
        times: shape (k,) [s].
        forces: in the axes of the base, shape (k, 3) [N].
        links: name of the link at whose origin each acts.
    """

    times: Array
    forces: Array
    links: tuple[str, ...]

    @staticmethod
    def none() -> LoadHistory:
        """Nothing hangs on the arm."""
        return LoadHistory(np.zeros(1), np.zeros((1, 3)), ("",))

    @property
    def changes(self) -> Array:
        """Times at which another force begins [s], the first one of a recording among them."""
        first = self.times[:1][np.any(self.forces[:1] != 0.0, axis=1) & (self.times[:1] > 0.0)]
        other = np.any(np.diff(self.forces, axis=0) != 0.0, axis=1)
        other |= np.array([a != b for a, b in zip(self.links[1:], self.links[:-1], strict=True)], dtype=bool)
        return np.append(first, self.times[1:][other])

    def at(self, time: float) -> tuple[Array, str]:
        """Force and link at a time."""
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        return (np.zeros(3), "") if k < 0 else (self.forces[k], self.links[k])
