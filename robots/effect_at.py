# SPDX-License-Identifier: BSD-3-Clause
"""An effect at its owner, as a robot has it."""

from __future__ import annotations

from dataclasses import dataclass

from jointscope.robots.effect_kinds.effect import Effect


@dataclass(frozen=True)
class EffectAt:
    """An effect that is part of a robot.

    Attributes:
        effect: the effect.
        owner: joint, gyro or "robot".
    """

    effect: Effect
    owner: str

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return f"{self.effect.id}@{self.owner}"

    def parameter(self, name: str) -> str:
        """Full name OWNER.EFFECT.NAME of a parameter."""
        return f"{self.owner}.{self.effect.id}.{name}"
