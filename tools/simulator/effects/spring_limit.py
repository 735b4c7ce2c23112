# SPDX-License-Identifier: BSD-3-Clause
"""A safety string beside a spring: a tendon of the engine that hangs slack until the spring is as long as it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.loose_string import add_string, slack_of


class SpringLimit(SimulatedEffect):
    """The string pulls where the link is more than `forward` ahead of the motor, or more than `backward` behind it."""

    id = "spring_limit"
    acts_on = ("elastic joint",)
    built_in = True
    defaults: ClassVar[Mapping[str, float]] = {"stiffness": 800.0, "forward": 0.02, "backward": 0.03}  # N m/rad, rad
    never_negative = ("stiffness",)
    above_zero = ("forward", "backward")

    def edit(self, spec: Any) -> None:
        """Adds the tendon between link and rotor."""
        low, high = slack_of(spec, self.owner)
        lengths = self.parameters["backward"], self.parameters["forward"]
        for side, length, slack in zip(("backward", "forward"), lengths, (-low, high), strict=True):
            if length < slack:
                raise EffectError(
                    f"effect {self.id}@{self.owner}: {side}: expected more than the slack of its rope, {slack:g} rad, "
                    f"got {length:g}: the string would be taut while the rope still hangs slack"
                )
        terms = self.parameters["stiffness"], (-lengths[0], lengths[1])
        add_string(spec, f"{self.owner}.string", self.owner, self.shares[self.owner], *terms)
