# SPDX-License-Identifier: BSD-3-Clause
"""What every physical effect has: an id, owners, parameters with a null value, a card.

An effect is a family of models: at the null values of its parameters the model is exactly the one without it. That
makes it testable without a refit, addable and removable. One effect is one file: a law and a module constant `EFFECT`
of one of the kinds in this folder. Files in `robots/effects/` are found by being there, a user's own by `--effects`.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.joint_torque import Memory
    from jointscope.robots.effect_kinds.robot_view import RobotView

OWNER_KINDS = ("joint", "joint_link", "gyro", "link_encoder", "target", "robot")
LINK_SIDE = ".link"  # behind a joint's name: its encoder on the link


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    Attributes:
        name: last part of the full name OWNER.EFFECT.NAME.
        unit: SI unit as text; "1" for a pure number.
        start: where a calibration starts after the effect was added, in `unit`.
        prior_sigma: standard deviation of the prior about the null value, in `unit`; wide, about ten times the largest
            size that is physically plausible. For a shape and for a logarithmic one the prior is about the start, and
            prior_sigma / start is the standard deviation of the logarithm: 3 means a factor of 20 either way.
        null: value at which the effect vanishes.
        sign: "+" if only values above null are physical, else "+-".
        logarithmic: whether a calibration estimates the logarithm, because the law has no meaning at or below zero.
        grid: for a shape, which has no null value (the speed of a Stribeck curve): values that a diagnosis tries;
            empty for a size. One value, the start, where a diagnosis need not try others.
        weak: whether the data may leave it open; its prior then holds it near the start.
        held: whether it is a choice of the law's form, which no calibration changes.
        of_range: "forward" or "backward" where `grid` has shares of the largest deflection of the spring that was seen
            that way, link ahead of or behind the motor; of the start where none was. Empty for values.
    """

    name: str
    unit: str
    start: float
    prior_sigma: float
    null: float = 0.0
    sign: str = "+-"
    logarithmic: bool = False
    grid: tuple[float, ...] = ()
    weak: bool = False
    held: bool = False
    of_range: str = ""

    @property
    def is_shape(self) -> bool:
        """Whether it has no null value of its own."""
        return bool(self.grid)


@dataclass(frozen=True)
class Card:
    """What a user reads about an effect.

    Attributes:
        title: a few words.
        law: the equation in plain text with its symbols.
        explanation: one or two sentences: the mechanism, in plain words.
        source: paper and equation, or a textbook.
        typical: typical size in machines of this kind.
        excitation: which motion shows it.
        look_alikes: ids of effects that are hard to tell apart, with the reason.
        numerics: True for defects of the computation, which are no physics.
    """

    title: str
    law: str
    explanation: str
    source: str
    typical: str
    excitation: str
    look_alikes: Mapping[str, str] = field(default_factory=dict)
    numerics: bool = False


@dataclass(frozen=True, kw_only=True)
class Effect(ABC):
    """What all kinds share.

    Attributes:
        id: short name, as in ID@OWNER.
        card: what a user reads.
        parameters: of every instance; kinds whose parameters depend on the owner override `parameters_of`.
        owners: kinds of owners: some of "joint", "joint_link" (a joint's encoder on the link, JOINT.link), "gyro",
            "link_encoder" (all of those together), "target" (of a tracker), "robot".
        turning: whether it can act only on joints that turn, not on prismatic ones.
        example: sizes for tests and demonstrations on the ready robots, by parameter name.
        aliases: other names that users may type.
        family: what effects have in common that are one law in more or less detail: searches take the member with the
            best evidence for all of them; empty for an effect of its own.
    """

    id: str
    card: Card
    parameters: tuple[EffectParameter, ...] = ()
    owners: tuple[str, ...] = ("joint",)
    turning: bool = False
    example: Mapping[str, float] = field(default_factory=dict)
    aliases: tuple[str, ...] = ()
    family: str = ""

    def may_act_on(self, robot: RobotView, owner: str) -> str:
        """Why the effect cannot act on an owner of this robot; empty if it can."""
        known = self.owners_of(robot)
        return "" if owner in known else f"acts on {', '.join(known) or 'nothing in this robot'}"

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """Everything in a robot that the effect can act on."""
        on_links = () if robot.link_encoder is None else (robot.link_encoder.name,)
        gyros = tuple(g.name for g in robot.gyros)
        joints = tuple(joint for joint in robot.joints if not (self.turning and joint in robot.tree.slides))
        links = tuple(f"{joint}{LINK_SIDE}" for joint in joints) if on_links else ()
        by_kind = {"joint": joints, "joint_link": links, "gyro": gyros, "link_encoder": on_links, "robot": ("robot",)}
        by_kind["target"] = tuple(target.name for target in robot.targets)
        return tuple(owner for kind in self.owners for owner in by_kind[kind])

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """Parameters of the instance at one owner, in the units of a joint that turns."""
        return self.parameters

    def memory_at(self, robot: RobotView, owner: str) -> Memory | None:
        """The state of its own that the instance at one owner has; None for none."""
        return None

    def parameters_at(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """The same in the units of the owner."""
        return tuple(replace(p, unit=robot.unit_at(owner, p.unit)) for p in self.parameters_of(robot, owner))
