# SPDX-License-Identifier: BSD-3-Clause
"""Free play between motor and link: a range of lengths in which the engine's spring is slack."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.tools.simulator.effect import SimulatedEffect
from jointscope.tools.simulator.specification import spring_tendon


class Backlash(SimulatedEffect):
    """The spring pulls only where the deflection exceeds half_gap, and there by the rest; damping stays."""

    id = "backlash"
    acts_on = ("joint",)
    defaults: ClassVar[Mapping[str, float]] = {"half_gap": 0.012}  # [rad]
    never_negative = ("half_gap",)

    def edit(self, spec: Any) -> None:
        """Widens the range in which the spring is slack."""
        half_gap = self.parameters["half_gap"]
        spec.tendon(spring_tendon(self.owner)).springlength = [-half_gap, half_gap]
