# SPDX-License-Identifier: BSD-3-Clause
"""Torques between joints that move together, where the model leaves them out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.structure import Structure

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView


@dataclass(frozen=True, kw_only=True)
class Coriolis(Structure):
    """Acts only on a robot whose model leaves c(q, v) out."""

    def may_act_on(self, robot: RobotView, owner: str) -> str:
        """Why it cannot act; empty if it can."""
        if owner == "robot" and robot.choices.coriolis:
            return "is part of the model already: the robot file says coriolis: true"
        return super().may_act_on(robot, owner)

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """The robot, unless its model has the terms."""
        return () if robot.choices.coriolis else ("robot",)


EFFECT = Coriolis(
    id="coriolis",
    owners=("robot",),
    form="coriolis",
    parameters=(EffectParameter("scale", "1", start=1.0, prior_sigma=10.0, sign="+"),),
    example={"scale": 1.0},
    card=Card(
        title="Coriolis and centrifugal torques",
        law="M a_link + s c(q, v) + g + tau_c = 0, with s = scale: 0 without, 1 as physics has it",
        explanation="Links that turn together push each other with torques that grow with the square of the speed. "
        "Anything far from 1 is not this effect.",
        source="Schuethe et al. (2016), eq. (1), neglected in eq. (5); Ho, Kisner (BioRob), eq. (7); Siciliano, Khatib "
        "(2008), Springer Handbook of Robotics",
        typical="1; the torques reach those of friction in fast motion",
        excitation="fast motion of several joints at once",
        look_alikes={
            "inertia_error": "a wrong inertia matters most in the same fast motion",
            "link_viscous": "within a narrow range of speeds any drag looks alike",
        },
    ),
)
