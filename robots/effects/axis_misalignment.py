# SPDX-License-Identifier: BSD-3-Clause
"""A joint whose axis does not stand as the URDF says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.structure import Structure

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView


@dataclass(frozen=True, kw_only=True)
class AxisMisalignment(Structure):
    """Acts only where nothing but the torques of the links shows it: what gyros and targets see is not turned."""

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """Joints that turn, of robots without gyros, accelerometers and targets; the first one under gravity only."""
        if robot.gyros or robot.accelerometers or robot.targets:
            return ()
        shown = robot.joints if np.any(robot.tree.gravity) else robot.joints[1:]
        return tuple(j for j in super().owners_of(robot) if j in shown and j not in robot.tree.massless)


EFFECT = AxisMisalignment(
    id="axis_misalignment",
    aliases=("link_twist",),
    turning=True,
    form="axis",
    parameters=tuple(EffectParameter(axis, "rad", start=0.0, prior_sigma=0.3) for axis in "xy"),
    example={"x": 0.05, "y": -0.04},
    card=Card(
        title="axis that is not aligned",
        law="P = P_model Exp(x e_x + y e_y), with P the placement of the joint on the link before it, and e_x, e_y the "
        "two coordinate axes of its frame across its own axis",
        explanation="The link before the joint is twisted or bent, or the joint is mounted askew. All that the joint "
        "carries stands askew, so that its weight and inertia reach joints that should not feel them.",
        source="Ho, Kisner (BioRob), app. A.1: link 2 is twisted by 5.1 degrees; Neubauer et al. (2015), sec. 4: "
        "mis_x, mis_y of each joint",
        typical="0.1 to 5 degrees",
        excitation="slow motion of the joints behind it in several postures under gravity, or fast motion of several "
        "joints",
        look_alikes={
            "gravity_direction": "of the first joint a turned axis is a base that is not level",
            "link_mass": "a centre of mass that stands askew is a first moment of the link",
            "inertia_error": "a body that stands askew has other moments about the axes before it",
            "encoder_offset": "where axes are nearly parallel, a turn about one is a zero of the other",
        },
    ),
)
