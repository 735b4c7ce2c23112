# SPDX-License-Identifier: BSD-3-Clause
"""Some channels of a sensor, where channels of one message were taken at different times.

Variables: those of the sensor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor, Linearization
from jointscope.factors.seen_through import SeenThrough

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SomeChannels(SeenThrough[Factor]):
    """Rows of a sensor factor on one state.

    Attributes:
        channels: chosen rows, shape (c,).
    """

    channels: NDArray[np.intp]

    @property
    def rows(self) -> tuple[str, ...]:
        """The chosen channels."""
        return tuple(self.inner.rows[j] for j in self.channels)

    @property
    def sigmas(self) -> Array:
        """Noise of the chosen channels."""
        return self.inner.sigmas[..., self.channels]

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
