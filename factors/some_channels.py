# SPDX-License-Identifier: BSD-3-Clause
"""Some channels of a sensor, where channels of one message were taken at different times.

Variables: those of the sensor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor, Linearization, Samples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SomeChannels:
    """Rows of a sensor factor on one state.

    Attributes:
        inner: all channels.
        channels: chosen rows, shape (c,).
    """

    inner: Factor
    channels: NDArray[np.intp]

    states = 1

    def __len__(self) -> int:
        return len(self.inner)

    @property
    def name(self) -> str:
        """Name of the sensor."""
        return self.inner.name

    @property
    def rows(self) -> tuple[str, ...]:
        """The chosen channels."""
        return tuple(self.inner.rows[j] for j in self.channels)

    @property
    def blocks(self) -> tuple[str, ...]:
        """Blocks of the sensor."""
        return self.inner.blocks

    @property
    def sigmas(self) -> Array:
        """Noise of the chosen channels."""
        return self.inner.sigmas[..., self.channels]

    def select(self, samples: Samples) -> SomeChannels:
        """The same factor for some of the samples."""
        return replace(self, inner=self.inner.select(samples))

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Residual of the chosen channels, shape (m, c)."""
        return self.inner.residual(x, calibration)[:, self.channels]

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives of the chosen channels."""
        inner = self.inner.linearize(x, calibration)
        return Linearization(
            inner.residual[:, self.channels],
            tuple(J[:, self.channels] for J in inner.by_state),
            {block: J[:, self.channels] for block, J in inner.by_block.items()},
        )
