# SPDX-License-Identifier: BSD-3-Clause
"""The drive limits its current: what is commanded beyond a level is lost, and the log does not show it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class CommandLimit(SimulatedEffect):
    """Of what is asked for beyond `limit` a part `lost` does nothing."""

    id = "command_limit"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"lost": 1.0, "limit": 0.15}  # [1], unit of the command
    never_negative = ("lost",)
    above_zero = ("limit",)

    def command(self, time: float, issued: Array) -> Array:
        """What the drive gives."""
        acting, joint, limit = np.array(issued), self.robot.joints.index(self.owner), self.parameters["limit"]
        if abs(issued[joint]) > limit:
            beyond = issued[joint] - np.copysign(limit, issued[joint])
            acting[joint] = issued[joint] - self.parameters["lost"] * beyond
        return acting
