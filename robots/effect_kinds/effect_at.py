# SPDX-License-Identifier: BSD-3-Clause
"""An effect at its owner, as a robot has it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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

    @property
    def family(self) -> str:
        """FAMILY@OWNER, the label of an effect that has none."""
        return f"{self.effect.family or self.effect.id}@{self.owner}"

    def parameter(self, name: str) -> str:
        """Full name OWNER.EFFECT.NAME of a parameter."""
        return f"{self.owner}.{self.effect.id}.{name}"

    def own(self, values: Mapping[str, float]) -> dict[str, float]:
        """The effect's own parameters by the last part of their name, from values by full name."""
        return {name: values[full] for name, full in self.own_names(values).items()}

    def own_names(self, names: Iterable[str]) -> dict[str, str]:
        """Full names of the effect's own parameters among some names, by their last part."""
        start = self.parameter("")
        return {name[len(start) :]: name for name in names if name.startswith(start)}
