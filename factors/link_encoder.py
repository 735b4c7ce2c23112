# SPDX-License-Identifier: BSD-3-Clause
"""Link encoder, behind the transmission: theta_measured - q_link - zero.

Variables: X at the time of the sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.encoder import EncoderFactor
from jointscope.robots.parts.sensors import LinkEncoder


@dataclass(frozen=True)
class LinkEncoderFactor(EncoderFactor[LinkEncoder]):
    """Residual = predicted - measured link angle; measured has shape (m, n) [rad]."""

    @property
    def columns(self) -> NDArray[np.intp]:
        """Of the link positions."""
        return self.layout.joint_q
