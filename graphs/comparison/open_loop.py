# SPDX-License-Identifier: BSD-3-Clause
"""Open-loop predictions and their errors, found when somebody looks at them.

One state walks through the whole recording tick by tick, which costs far more than thousands of short predictions side
by side. A search for missing effects compares a model after every step and asks for none of it; tables and pictures do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

OPEN_LOOP = "open_loop"


class OpenLoop:
    """Predictions at all samples from the first state and the commands alone.

    Args:
        find: computes them, by sensor.
    """

    def __init__(self, find: Callable[[], dict[str, Array]]):
        self._find = find

    @cached_property
    def sensors(self) -> dict[str, Array]:
        """By sensor: NaN outside the ticks, infinite where the model has run away, shape (m, c)."""
        return self._find()

    def of(self, sensor: str) -> Callable[[], Array]:
        """Finds those of a sensor; NaN instead of infinite ones."""
        return lambda: np.where(np.isfinite(self.sensors[sensor]), self.sensors[sensor], np.nan)


class Horizons(Mapping[str, float]):
    """Root mean square errors by horizon, the last of them in open loop.

    Args:
        ahead: those that are known, by horizon [s].
        open_loop: finds the last one.
    """

    def __init__(self, ahead: Mapping[str, float], open_loop: Callable[[], float]):
        self._ahead, self._open_loop = dict(ahead), open_loop

    @cached_property
    def _last(self) -> float:
        return self._open_loop()

    def __getitem__(self, horizon: str) -> float:
        """Error at a horizon."""
        return self._last if horizon == OPEN_LOOP else self._ahead[horizon]

    def __iter__(self) -> Iterator[str]:
        """Horizons, the open loop last."""
        return iter((*self._ahead, OPEN_LOOP))

    def __len__(self) -> int:
        """Number of horizons."""
        return len(self._ahead) + 1
