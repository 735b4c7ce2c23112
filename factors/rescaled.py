# SPDX-License-Identifier: BSD-3-Clause
"""A sensor factor whose samples tell less than their sigma says, each by a factor of its own.

Variables: those of the sensor. A quantized encoder in slow motion repeats one error many times; taken as independent,
its samples would promise a precision that averaging them cannot reach.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor, Linearization, Samples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RescaledFactor:
    """A factor with larger sigmas.

    Attributes:
        inner: the factor.
        scale: factor on the sigma of each row of each sample, shape (m, r).
    """

    inner: Factor
    scale: Array

    def __len__(self) -> int:
        return len(self.inner)

    @property
    def name(self) -> str:
        """Name of the sensor."""
        return self.inner.name

    @property
    def rows(self) -> tuple[str, ...]:
        """Rows of the sensor."""
        return self.inner.rows

    @property
    def states(self) -> int:
        """Number of states each sample touches."""
        return self.inner.states

    @property
    def blocks(self) -> tuple[str, ...]:
        """Blocks of the sensor."""
        return self.inner.blocks

    @property
    def sigmas(self) -> Array:
        """Rescaled standard deviations, shape (m, r)."""
        return self.inner.sigmas * self.scale

    def select(self, samples: Samples) -> RescaledFactor:
        """The same factor for some of the samples."""
        return replace(self, inner=self.inner.select(samples), scale=self.scale[samples])

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Residual of the sensor."""
        return self.inner.residual(x, calibration)

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives of the sensor."""
        return self.inner.linearize(x, calibration)
