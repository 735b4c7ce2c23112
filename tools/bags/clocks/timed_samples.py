# SPDX-License-Identifier: BSD-3-Clause
"""Samples with the time at which they were taken and the time at which they were written to the bag."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class TimedSamples:
    """Samples with their two times.

    Attributes:
        stamps: time of measurement, shape (n,) [ns].
        received: time of writing to the bag, shape (n,) [ns].
        values: shape (n, m).
        filled: whether a value stands for one that was no number, or is still NaN because the message is not about that
            joint, shape (n, m); None where all were measured.
    """

    stamps: NDArray[np.int64]
    received: NDArray[np.int64]
    values: NDArray[np.float64]
    filled: NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        return len(self.stamps)

    def take(self, index: NDArray[Any]) -> TimedSamples:
        """Some of the samples."""
        filled = None if self.filled is None else self.filled[index]
        return TimedSamples(self.stamps[index], self.received[index], self.values[index], filled)

    def stamped(self, stamps: NDArray[np.int64]) -> TimedSamples:
        """The same samples with other stamps."""
        return replace(self, stamps=stamps)

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Whether a value was measured, shape (n, m)."""
        return np.ones(self.values.shape, bool) if self.filled is None else ~self.filled

    @property
    def held(self) -> NDArray[np.float64]:
        """The value measured last, or first of all, where another stands for it, shape (n, m)."""
        if self.filled is None:
            return self.values
        rows = np.where(self.filled, 0, np.arange(len(self))[:, None])
        first = np.argmax(self.measured, axis=0)
        last = np.maximum(np.maximum.accumulate(rows, axis=0), first)
        return np.take_along_axis(self.values, last, axis=0)

    @property
    def latency(self) -> NDArray[np.float64]:
        """How much later than its stamp each sample was written, shape (n,) [s]; whole numbers are subtracted first."""
        return (self.received - self.stamps) / 1e9

    @property
    def reception_tells(self) -> bool:
        """Whether the times of writing are those at which messages came in, and not all the same or copied stamps."""
        if len(self) < 2:
            return False
        period = np.median(np.abs(np.diff(self.received)))
        return bool(
            period > 0 and np.all(np.diff(self.received) >= 0) and not np.array_equal(self.stamps, self.received)
        )
