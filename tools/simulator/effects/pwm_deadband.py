# SPDX-License-Identifier: BSD-3-Clause
"""The bridge of the drive has dead times: small commands do nothing, larger ones lose as much."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class PwmDeadband(SimulatedEffect):
    """Commands lose `width`, and are zero below it."""

    id = "pwm_deadband"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"width": 0.02}  # unit of the command
    never_negative = ("width",)

    def command(self, time: float, issued: Array) -> Array:
        """What is left of the command."""
        acting, joint, width = np.array(issued), self.robot.joints.index(self.owner), self.parameters["width"]
        acting[joint] -= np.clip(acting[joint], -width, width)
        return acting
