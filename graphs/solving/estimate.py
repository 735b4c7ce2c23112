# SPDX-License-Identifier: BSD-3-Clause
"""Values of everything that a batch solve estimates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.solving.shared_layout import SharedLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """States and shared values of all recordings.

    Attributes:
        states: states of each recording, shape (m + 1, 4n).
        calibrations: shared values with the biases of each recording.
    """

    states: tuple[Array, ...]
    calibrations: tuple[Calibration, ...]

    def moved(self, dx: Sequence[Array], dp: Array, shared: SharedLayout) -> Estimate:
        """The estimate after a step."""
        return Estimate(
            tuple(x + d for x, d in zip(self.states, dx, strict=True)),
            tuple(c.retract(shared.step(dp, i)) for i, c in enumerate(self.calibrations)),
        )
