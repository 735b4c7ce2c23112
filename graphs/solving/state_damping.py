# SPDX-License-Identifier: BSD-3-Clause
"""Damping of the states only where a step made the cost rise.

Where a joint turns over, dry friction bends: a step that is right for all other states overshoots there, and a damping
for all would slow every state down. The cost belongs to ticks, so a rejected step says where it went too far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

Array = NDArray[np.float64]

REACH = 0.06  # [s] states before and after a bend that move with it
FIRST, FACTOR, LARGEST = 3e-8, 30.0, 1e-2  # relative to the diagonal
OF_LARGEST = 0.05  # share of the largest rise from which a rise counts
MOST_TRIES = 4  # of one step; then the damping of all has its turn
FEW = 0.3  # share of all ticks; where more of them rise, it is not the bends that are too far


@dataclass
class StateDamping:
    """Levenberg-Marquardt lambda of each tick.

    Attributes:
        values: of each recording, shape (m,), relative to the diagonal.
        reach: ticks that REACH spans, of each recording.
        tries: since the last step that was accepted.
    """

    values: list[Array]
    reach: list[int]
    tries: int = 0

    @staticmethod
    def of(ticks: Sequence[Array]) -> StateDamping:
        """None yet; ticks of each recording, shape (m,) [s]."""
        steps = [max(float(np.median(np.diff(t))), 1e-9) if len(t) > 1 else REACH for t in ticks]
        return StateDamping([np.zeros(len(t)) for t in ticks], [max(round(REACH / h), 1) for h in steps])

    def raised(self, before: Sequence[Array], there: Sequence[Array]) -> bool:
        """Raises the damping around the ticks at which a rejected step made the cost rise.

        Args:
            before: cost of each tick of each recording, shape (m,).
            there: the same after the step.

        Returns:
            Whether another try makes sense: the rise is that of a few places whose damping was not the largest yet.
        """
        pairs = zip(before, there, self.reach, strict=True)
        rises = [uniform_filter1d(b - a, 2 * n + 1, mode="constant") for a, b, n in pairs]
        if not all(np.all(np.isfinite(rise)) for rise in rises):
            return False
        largest = max((float(np.max(rise)) for rise in rises if len(rise)), default=0.0)
        marked = [
            maximum_filter1d((rise > OF_LARGEST * largest).astype(int), 2 * n + 1) > 0
            for rise, n in zip(rises, self.reach, strict=True)
        ]
        if largest <= 0.0 or sum(map(np.sum, marked)) > FEW * sum(map(len, marked)):
            return False
        if self.tries >= MOST_TRIES or any(
            np.any(values[here] >= LARGEST) for values, here in zip(self.values, marked, strict=True)
        ):
            return False
        self.tries += 1
        for values, here in zip(self.values, marked, strict=True):
            values[here] = np.maximum(FACTOR * values[here], FIRST)
        return True

    @property
    def later(self) -> list[Array]:
        """What it will be after a step that is accepted."""
        return [np.where(values / FACTOR < FIRST / FACTOR, 0.0, values / FACTOR) for values in self.values]

    def relaxed(self) -> None:
        """Lowers it after a step that was accepted."""
        self.tries, self.values = 0, self.later
