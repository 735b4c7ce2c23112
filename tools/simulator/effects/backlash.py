# SPDX-License-Identifier: BSD-3-Clause
"""Free play between motor and link, as much to either side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointscope.tools.simulator.world.slack_spring import SlackSpring


class Backlash(SlackSpring):
    """Spring and damper act only where the deflection exceeds half_gap; the spring there by the rest."""

    id = "backlash"
    defaults: ClassVar[Mapping[str, float]] = {"half_gap": 0.012}  # [rad]
    never_negative = ("half_gap",)
    size = "twice half_gap"

    def slack(self) -> tuple[float, float]:
        """The free play [rad]."""
        return -self.parameters["half_gap"], self.parameters["half_gap"]
