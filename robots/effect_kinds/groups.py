# SPDX-License-Identifier: BSD-3-Clause
"""Where in a robot an effect sits, for lists."""

from __future__ import annotations

from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.effect_kinds.robot_torque import RobotTorque
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.effect_kinds.transmission_elements import TransmissionElements

GROUPS = ("motor side", "transmission", "link", "structure", "sensors", "numerics")
SIDES = {"motor": "motor side", "spring": "transmission", "link": "link"}


def group_of(effect: Effect) -> str:
    """One of GROUPS."""
    if effect.card.numerics:
        return "numerics"
    if isinstance(effect, JointTorque):
        return SIDES[effect.side]
    if isinstance(effect, CommandEffect):
        return "motor side"
    if isinstance(effect, RobotTorque | TransmissionElements):
        return "transmission"
    if isinstance(effect, InertiaEffect):
        return "link"
    if isinstance(effect, Structure):
        return "link" if effect.form in ("coriolis", "gravity", "loads") else "structure"
    return "sensors"
