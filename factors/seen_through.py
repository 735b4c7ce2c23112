# SPDX-License-Identifier: BSD-3-Clause
"""A factor seen through something: fewer of its channels, another noise, other times, effects on its reading.

Variables: those of the factor inside. Each child says only what it changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor, Linearization, Samples

Array = NDArray[np.float64]
Inner = TypeVar("Inner", bound=Factor, covariant=True)


@dataclass(frozen=True)
class SeenThrough(Generic[Inner]):
    """The factor inside, unchanged.

    Attributes:
        inner: what is seen.
    """

    inner: Inner

    def __len__(self) -> int:
        return len(self.inner)

    @property
    def name(self) -> str:
        """Name of the sensor."""
        return self.inner.name

    @property
    def rows(self) -> tuple[str, ...]:
        """Channels."""
        return self.inner.rows

    @property
    def states(self) -> int:
        """Number of states each sample touches."""
        return self.inner.states

    @property
    def blocks(self) -> tuple[str, ...]:
        """Blocks of the calibration the residual depends on."""
        return self.inner.blocks

    @property
    def sigmas(self) -> Array:
        """Noise of each row, shape (r,) or (m, r), SI unit of the sensor."""
        return self.inner.sigmas

    def select(self, samples: Samples) -> Self:
        """The same factor for some of the samples."""
        return replace(self, inner=self.inner.select(samples))

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, r)."""
        return self.inner.residual(x, calibration)

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        return self.inner.linearize(x, calibration)
