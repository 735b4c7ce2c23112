# SPDX-License-Identifier: BSD-3-Clause
"""The supply voltage sags under load: every drive gets less when all together push hard."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.loop.controller import full_command
from jointscope.tools.simulator.world.effect import SimulatedEffect

Array = NDArray[np.float64]


class SupplySag(SimulatedEffect):
    """Commands act with the factor 1 - drop times the mean of all |command| as shares of the full one."""

    id = "supply_sag"
    acts_on = ("robot",)
    defaults: ClassVar[Mapping[str, float]] = {"drop": 0.2}  # share lost when all motors push fully
    never_negative = ("drop",)
    outside_catalogue = True

    def command(self, time: float, issued: Array) -> Array:
        """What the drives get."""
        load = float(np.mean(np.abs(issued) / full_command(self.robot)))
        return issued * max(0.0, 1.0 - self.parameters["drop"] * load)
