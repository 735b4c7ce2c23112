# SPDX-License-Identifier: BSD-3-Clause
"""How far a sample was from what the estimator expected before it came."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Innovation:
    """Measured minus predicted.

    Attributes:
        sensor: name of the sensor.
        time: stamp of the sample [s].
        channels: names of its channels that were looked at.
        residual: measured - predicted, shape (c,) [unit of the sensor].
        sigma: its expected standard deviation, shape (c,).
        nis: normalised innovation squared; chi-square with `dof` degrees of freedom if model and noise are right.
        dof: number of channels.
        used: False where the sample was taken for an outlier.
    """

    sensor: str
    time: float
    channels: tuple[str, ...]
    residual: Array
    sigma: Array
    nis: float
    dof: int
    used: bool
