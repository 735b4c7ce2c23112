# SPDX-License-Identifier: BSD-3-Clause
"""A regressor: what one size of an effect does to accelerations and readings at its null value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis

Array = NDArray[np.float64]
STEP = 1e-30  # of complex steps

SensorColumn = Callable[["SensorPart"], Array]


@dataclass(frozen=True)
class SensorPart:
    """Some samples of a sensor, as its factor was linearised.

    Attributes:
        name: of the sensor.
        channels: index of each row among the sensor's channels, shape (r,).
        stamps: shape (s,) [s].
        reading: predicted reading without zero or bias, shape (s, r).
        reading_rate: its time derivative, shape (s, r).
        reading_bend: its second time derivative, of readings that depend on positions alone, shape (s, r).
    """

    name: str
    channels: NDArray[np.intp]
    stamps: Array
    reading: Array
    reading_rate: Array
    reading_bend: Array


@dataclass(frozen=True)
class Column:
    """Regressor of one size.

    Attributes:
        at_ticks: accelerations at the ticks, shape (m + 1, r); None for none.
        at_ends: the same where each step ends, shape (m, r); None where it is that of the next tick.
        between: the same in the middle of each step, shape (m, r); None where it was not looked at.
        in_steps: accelerations held over the steps, shape (m, r); None for none.
        reading: error of readings, shape (s, r) for a SensorPart; None for none.
        better_integrator: whether the column is what Simpson's rule adds to the defects of the model's own.
    """

    at_ticks: Array | None = None
    at_ends: Array | None = None
    in_steps: Array | None = None
    reading: SensorColumn | None = field(default=None, repr=False)
    better_integrator: bool = False
    between: Array | None = None


def null_values(hypothesis: EffectHypothesis) -> dict[str, float]:
    """Sizes at null and the shapes that are tried, by name."""
    return {**{p.name: p.null for p in hypothesis.sizes}, **hypothesis.shapes}
