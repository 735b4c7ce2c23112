# SPDX-License-Identifier: BSD-3-Clause
"""Ropes that hang slack: the one that pulls the link forward, the one that pulls it back, or both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointscope.tools.simulator.world.slack_spring import SlackSpring


class SpringSlack(SlackSpring):
    """Each rope pulls only beyond its own slack: `forward` where the link is ahead of the motor, `backward` behind."""

    id = "spring_slack"
    defaults: ClassVar[Mapping[str, float]] = {"forward": 0.03, "backward": 0.0}  # [rad]
    never_negative = ("forward", "backward")
    size = "the slack of both ropes"

    def slack(self) -> tuple[float, float]:
        """The range in which neither rope is taut [rad]."""
        return -self.parameters["backward"], self.parameters["forward"]
