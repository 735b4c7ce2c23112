# SPDX-License-Identifier: BSD-3-Clause
"""Effects of one spring in a robot file that must agree: its curve, the slack of its ropes, its string."""

from __future__ import annotations

import numpy as np

from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointTorque, is_spring_law
from jointscope.robots.errors import RobotError
from jointscope.robots.files.effect_editing import cannot_be_added
from jointscope.robots.model.robot import Robot

SIDES = ("backward", "forward")


def check_curves(robot: Robot, place: str) -> None:
    """Checks the effects of each spring against each other.

    Args:
        robot: the robot; parameters that its file lacks are another check's concern.
        place: name of the file.

    Raises:
        RobotError: two curves or dead zones of one spring, a dead zone as wide as the travel of the motor, a string
            that is shorter than the slack of its rope, or a knot at zero or below.
    """
    for here in robot.effects:
        if is_spring_law(here.effect):
            why_not = cannot_be_added(robot, here)
            if why_not:
                raise RobotError(f"{place}: effects: {here.label}: {why_not}")
            _check_knots(robot, here, place)
            slack = _slack(robot, here)
            if slack is not None:
                _check_slack(robot, here, slack, place)


def travel(robot: Robot, joint: str) -> float:
    """How far the motor turns for the whole range of its joint, infinite where the URDF sets no limits [rad]."""
    i = robot.joints.index(joint)
    own = 1.0 if robot.transmission is None else abs(float(robot.transmission[i, i]))
    range_of_joint = float(np.ptp(np.asarray(robot.tree.limits)[i]))
    return range_of_joint / own if own > 0.0 and np.isfinite(range_of_joint) else np.inf


def _check_knots(robot: Robot, here: EffectAt, place: str) -> None:
    for p in here.effect.parameters:
        found = robot.parameters.get(here.parameter(p.name))
        if p.of_range and found is not None and found.value <= 0.0:
            raise RobotError(
                f"{place}: parameters.{found.name}: expected a deflection above zero, from which the knots of that "
                f"side follow in order, got {found.value:g}; write how far the spring is deflected to that side"
            )


def _slack(robot: Robot, here: EffectAt) -> tuple[float, float] | None:
    """The dead zone of an effect, backward and forward; None for another effect, or where the file lacks its values."""
    assert isinstance(here.effect, JointTorque)
    names = [here.parameter(name) for name in here.effect.gap]
    if not names or any(name not in robot.parameters for name in names):
        return None
    values = [robot.parameters[name].value for name in names]
    return values[0], values[-1]


def _check_slack(robot: Robot, here: EffectAt, slack: tuple[float, float], place: str) -> None:
    width, most = sum(slack), travel(robot, here.owner)
    if width >= most:
        raise RobotError(
            f"{place}: parameters of {here.label}: a slack of {width:g} rad is as wide as all that the motor turns its "
            f"joint ({most:.3g} rad), expected less: its spring would never be stretched; is it in degrees?"
        )
    for side, own in zip(SIDES, slack, strict=True):
        string = robot.parameters.get(f"{here.owner}.spring_limit.{side}")
        if string is not None and robot.has_effect("spring_limit", here.owner) and string.value <= own:
            raise RobotError(
                f"{place}: parameters.{string.name}: expected more than the slack of {here.label} on that side, "
                f"{own:g} rad, got {string.value:g}: the string would be taut while the rope hangs slack; correct one "
                "of the two"
            )
