# SPDX-License-Identifier: BSD-3-Clause
"""The driver logs whole steps of what it commands, cut toward zero: what acts is larger by a part of a step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]

GOLDEN = 0.6180339887498949  # multiples of it fill the unit interval evenly
HELD = 1e-3  # [s] after which another part of a step was lost


class TruncatedCommand(SimulatedEffect):
    """Each command was cut by a part of a step, any part as often as another; `lost` is the mean."""

    id = "truncated_command"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"lost": 0.005}  # unit of the command
    never_negative = ("lost",)

    def command(self, time: float, issued: Array) -> Array:
        """What the driver was asked for, before it cut."""
        acting, joint, step = np.array(issued), self.robot.joints.index(self.owner), 2.0 * self.parameters["lost"]
        part = (np.floor(time / HELD) * GOLDEN) % 1.0
        acting[joint] += np.copysign(part * step, issued[joint]) if issued[joint] else 0.0
        return acting
