# SPDX-License-Identifier: BSD-3-Clause
"""What a sensor measured beside what the smoothed states say."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ResidualSeries:
    """Measured and predicted values of one sensor over time (predicted from the smoothed states).

    Attributes:
        channels: names of the columns.
        units: SI unit of each.
        times: shape (m,) [s].
        measured, predicted: shape (m, c) [unit]; the latter NaN where a sample is not about that channel.
        sigma: expected standard deviation of measured - predicted, shape (m, c) [unit].
        chi2: mean square of residual over sigma, corrected for the freedom of the states, shape (c,).
    """

    channels: tuple[str, ...]
    units: tuple[str, ...]
    times: Array
    measured: Array
    predicted: Array
    sigma: Array
    chi2: Array = field(default_factory=lambda: np.ones(0))
