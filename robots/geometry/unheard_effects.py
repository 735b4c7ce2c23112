# SPDX-License-Identifier: BSD-3-Clause
"""Effects in a robot file that act on poses or frequency responses, too, and of which their arm has no part.

Motion and rests evaluate every law of the catalogue; an arm at poses or shaken knows those of `arm_effects` alone. What
another effect does there is put on geometry and stiffnesses, so that a user has to be told.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque
from jointscope.robots.effect_kinds.lagging_reading import LaggingReading
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.effect_kinds.robot_torque import RobotTorque
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.geometry.arm_effects import KINDS, POSES
from jointscope.robots.geometry.error_parameters import LINK_MOMENTS, VISCOUS
from jointscope.robots.model.robot import Robot

FORMS = ("bearing", "elasticity", "gravity", "axis")  # of structural effects that bend or turn an arm
STATIC = 4  # of the ten dynamic parameters of a body: its mass and first moments have a weight


def unheard_effects(robot: Robot, kind: str) -> tuple[str, ...]:
    """Labels of effects that do something at their values, and that recordings of a kind do not know.

    Args:
        robot: with its effects.
        kind: of the recordings, POSES or FREQUENCY.
    """
    return tuple(here.label for here in robot.effects if _is_unheard(here, robot, kind) and _acts(here, robot, kind))


def _is_unheard(here: EffectAt, robot: Robot, kind: str) -> bool:
    """Whether one of its sizes is not its null value, and nothing that the arm has."""
    heard = {f"{here.owner}.{part}" for part in (*LINK_MOMENTS, VISCOUS)}
    for known in KINDS:
        if kind not in known.unseen:
            heard |= {*known.parameters(here.owner), f"{here.owner}.{known.catalogue[0]}"}
    for p in here.effect.parameters_at(robot, here.owner):
        name, size = here.parameter(p.name), not p.is_shape and not p.held
        if size and name not in heard and name in robot.parameters and robot.parameters[name].value != p.null:
            return True
    return False


def _acts(here: EffectAt, robot: Robot, kind: str) -> bool:
    """Whether recordings of a kind feel it."""
    effect, at_rest = here.effect, kind == POSES
    own = here.own({name: p.value for name, p in robot.parameters.items()})
    if isinstance(effect, JointTorque):
        return _is_felt(effect, own, at_rest)
    if isinstance(effect, InertiaEffect):
        change = effect.change_at(robot, here.owner, np.arange(1.0, 11.0))
        return not at_rest or any(np.any(change[name][:STATIC] != 0.0) for name, value in own.items() if value)
    if isinstance(effect, ReadingEffect):
        t, some = np.zeros(2), np.array([[0.3], [0.7]])
        if here.owner.removesuffix(LINK_SIDE) not in robot.joints:
            return False
        read = effect.law(some, t, own)
        return at_rest or bool(np.ptp(np.real(read)) > 0.0)  # a zero that is off shakes nothing
    if isinstance(effect, SmoothedReading | TimeShift):
        return not at_rest and here.owner.removesuffix(LINK_SIDE) in robot.joints
    return isinstance(effect, RobotTorque | LaggingReading) or (isinstance(effect, Structure) and effect.form in FORMS)


def _is_felt(effect: JointTorque, own: dict[str, float], at_rest: bool) -> bool:
    """Whether a torque is there at rest on the side of the link, or changes with any signal."""
    q = np.array([0.3, -0.2, 0.5])
    deflected, zero = q + np.array([0.05, -0.04, 0.2]), np.zeros(3)
    load = np.array([20.0, -30.0, 50.0])
    still = JointSignals(deflected, zero, q, zero, load, 1e3, memory=np.array([0.5, -0.5, 0.2]))
    if at_rest:
        return effect.side != "motor" and bool(np.any(effect.law(still, own) != 0.0))
    moving = replace(still, v_link=np.array([0.7, -0.4, 1.0]), v_motor=np.array([0.6, -0.5, 1.2]))
    return bool(np.ptp(np.real(effect.law(moving, own) * np.ones(3))) > 0.0)
