# SPDX-License-Identifier: BSD-3-Clause
"""Values of drives by regression, beside those of a calibration: two ways that should end at the same place.

Regression knows rigid joints with dry and viscous friction. Where the model of a robot has more than that, or
where little of the torque is explained, it says nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from jointscope.graphs.starts.drive_regression import GAIN, VISCOUS, DriveEquation, Value
from jointscope.graphs.starts.drive_starts import LIMIT, PLAIN, equations_of, parts_of
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

DELAY = "command_delay@robot"
TOLD = 0.15  # relative sigma up to which a constant tells anything
EXPLAINED = 0.99  # of the mean square of the driving torque, below which the model of the regression is another one


def regressed_values(robot: Robot, recordings: Sequence[Recording]) -> dict[str, Value]:
    """Values with sigmas by the name of the parameter; empty where regression does not apply.

    Where commands are torques "J.torque_constant" says how many N m one of them makes; it should be 1.

    Args:
        robot: the calibrated robot; a delay of its commands is taken from it.
        recordings: those of the calibration.
    """
    labels = {here.label for here in robot.effects if here.effect.id not in (PLAIN, LIMIT)}
    if robot.layout.motors or robot.choices.link_dynamics != "model" or labels - {DELAY}:
        return {}
    robot = robot.in_posture(recordings[0].posture)
    delay = robot.parameter("robot.command_delay.delay").value if labels else 0.0
    found: dict[str, Value] = {}
    for joint, equation in zip(robot.joints, equations_of(robot, recordings, delay), strict=True):
        found |= _of_joint(robot, joint, equation) | _made_by_one(robot, joint, equation)
    return found


def on_their_word(robot: Robot, found: Mapping[str, Value]) -> list[str]:
    """A sentence about commands that are torques, on joints where no weight tells it; nothing if the user said so.

    Args:
        robot: the calibrated robot.
        found: what the regression said, see `regressed_values`.
    """
    if not found or robot.drive_gain is not None or robot.command.confirmed:
        return []
    made = {joint: found.get(f"{joint}.torque_constant") for joint in robot.joints}
    untold = [joint for joint, one in made.items() if one is None or one.sigma > TOLD * abs(one.value)]
    if not untold or not any(f"{joint}.inertia" in found for joint in untold):
        return []
    return [
        f"nothing in the recording shows that the commands of {', '.join(untold)} are torques in their unit (no weight "
        "changes there): the values are in proportion to them"
    ]


def _of_joint(robot: Robot, joint: str, equation: DriveEquation) -> dict[str, Value]:
    """What one equation says about parameters that no other joint shares."""
    parts = parts_of(robot, joint)
    known = {law: sum(f * p.value for p, f in some) for law, some in parts.items() if all(p.fixed for p, _ in some)}
    if GAIN not in parts:
        known[GAIN] = 1.0
    if VISCOUS not in parts:
        known[VISCOUS] = 0.0
    values = equation.solve(known)
    full = {**known, **{law: value.value for law, value in values.items()}}
    if not values or not _explains(equation, full):
        return {}
    found = {}
    for law, value in values.items():
        free = [(p, f) for p, f in parts[law] if not p.fixed]
        held = sum(f * p.value for p, f in parts[law] if p.fixed)
        if len(free) == 1 and free[0][0].name.startswith(f"{joint}."):
            parameter, factor = free[0]
            found[parameter.name] = Value((value.value - held) / factor, value.sigma / abs(factor))
    return found


def _made_by_one(robot: Robot, joint: str, equation: DriveEquation) -> dict[str, Value]:
    """Torque of one unit of a command that should be a torque; empty where it is none, or nothing can be told."""
    values = equation.solve() if robot.drive_gain is None else {}
    made = values.get(GAIN)
    if made is None or not _explains(equation, {law: value.value for law, value in values.items()}):
        return {}
    return {f"{joint}.torque_constant": made}


def _explains(equation: DriveEquation, values: dict[str, float]) -> bool:
    driving = equation.torque(values[GAIN])
    return driving > 0.0 and equation.missing(values) ** 2 < (1.0 - EXPLAINED) * driving**2
