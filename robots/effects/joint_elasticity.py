# SPDX-License-Identifier: BSD-3-Clause
"""A spring between motor and link of a joint that was taken for rigid."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.structure import Structure

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

RESONANCE = 2.0 * np.pi * 10.0  # [rad/s] of the link on the spring at the start
DAMPING_RATIO = 0.05


@dataclass(frozen=True, kw_only=True)
class JointElasticity(Structure):
    """Acts only on joints that the robot file declares rigid."""

    def may_act_on(self, robot: RobotView, owner: str) -> str:
        """Why it cannot act; empty if it can."""
        if owner in robot.joints and owner not in robot.choices.rigid_joints:
            return f"cannot act on {owner}, which has a spring already; only a joint declared rigid can get one"
        if owner in robot.tree.massless:
            return f"cannot act on {owner}, which moves no inertia in the URDF: nothing would swing on the spring"
        return super().may_act_on(robot, owner)

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """The joints declared rigid that move an inertia."""
        massless = robot.tree.massless
        return tuple(j for j in robot.joints if j in robot.choices.rigid_joints and j not in massless)

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """Starts at a resonance of 10 Hz with the inertia that the joint moves at zero angles."""
        j = robot.joints.index(owner)
        inertia = float(robot.tree.mass_matrix(np.zeros((1, robot.n)))[0, j, j])
        if inertia <= 0.0:  # a robot whose masses are not known
            return self.parameters
        start = {
            "compliance": 1.0 / (inertia * RESONANCE**2),
            "damping": 2.0 * DAMPING_RATIO * inertia * RESONANCE,
        }
        compliance, damping = (
            replace(p, start=start[p.name], prior_sigma=3.0 * start[p.name]) for p in self.parameters
        )
        return compliance, replace(damping, grid=(damping.start,))


EFFECT = JointElasticity(
    id="joint_elasticity",
    form="elasticity",
    parameters=(
        EffectParameter("compliance", "rad/(N m)", start=1e-3, prior_sigma=3e-3, sign="+", logarithmic=True),
        EffectParameter("damping", "N m s/rad", start=1.0, prior_sigma=3.0, sign="+", logarithmic=True, grid=(1.0,)),
    ),
    example={"compliance": 1.0 / 200.0, "damping": 4.0},
    card=Card(
        title="elastic transmission",
        law="tau_c = (q_link - q_motor) / compliance + damping (v_link - v_motor) joins motor and link",
        explanation="Belt, cable or gear give way between a motor and its link, which then oscillates behind the "
        "motor. Only for joints that the robot file declares rigid; the others have a spring.",
        source="Spong (1987), Modeling and control of elastic joint robots, J. Dynamic Systems, Measurement, and "
        "Control 109(4); Schuethe et al. (2016), eq. (1), (2), (6)",
        typical="resonance of the link at 3 to 30 Hz",
        excitation="hard stops, steps and chirps of the joint through its resonance",
        look_alikes={
            "encoder_filter": "both let the link move more than the encoder reads, by the same law below the resonance",
            "bearing_flexibility": "both let the body oscillate after a stop; the bearing turns it about other axes",
            "encoder_delay": "below the resonance the difference between motor and link looks like one in time",
        },
    ),
)
