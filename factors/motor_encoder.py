# SPDX-License-Identifier: BSD-3-Clause
"""Motor encoder, eq. (20) of Schuethe, Wenk, Frese (2016): theta_measured - q_motor - zero.

Variables: X at the time of the sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.encoder import EncoderFactor
from jointscope.robots.parts.sensors import MotorEncoder


@dataclass(frozen=True)
class MotorEncoderFactor(EncoderFactor[MotorEncoder]):
    """Residual = predicted - measured motor angle; measured has shape (m, n) [rad]."""

    @property
    def columns(self) -> NDArray[np.intp]:
        """Of the motor positions."""
        return self.layout.motor_q
