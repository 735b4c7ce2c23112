# SPDX-License-Identifier: BSD-3-Clause
"""Joints that stick although the sharpness of their friction is looked for: no sharpness explains a joint that is held.

Whoever looks for a sharpness asks how slow motion ends. Where friction truly holds, the answer is a compromise, and
the moments of standstill lack far more than those of motion. Then the sharpness stays as it was found, and the
calibration asks the moving joint alone, as it does of every other joint.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.problem.standstill import leaving_standstill_out
from jointscope.robots.model.robot import SHARPNESS, Robot

Array = NDArray[np.float64]

STICKS = 2.0  # times the deviation of the motion, in units of what is expected, at standstill
FEWEST = 20  # steps of either kind that tell


def sticking_joints(result: CalibrationResult) -> dict[str, float]:
    """Sharpness that was found, of rigid joints whose standstills it does not explain."""
    robot, found = result.robot, {}
    for joint in robot.joints:
        own = robot.parameters.get(f"{joint}.{SHARPNESS}")
        if own is None or own.fixed or joint in robot.layout.motors:
            continue
        still, moving = _squares(result, holding(robot, {joint: own.value}), joint)
        if min(len(still), len(moving)) >= FEWEST and np.mean(still) > STICKS**2 * np.mean(moving):
            found[joint] = own.value
    return found


def holding(robot: Robot, sharpness: dict[str, float]) -> Robot:
    """The robot with the sharpness of some joints held at a value."""
    names = {f"{joint}.{SHARPNESS}": value for joint, value in sharpness.items()}
    parameters = {
        name: replace(p, value=names[name], fixed=True) if name in names else p for name, p in robot.parameters.items()
    }
    return replace(robot, parameters=parameters)


def asked_again(robot: Robot, result: CalibrationResult, sharpness: dict[str, float]) -> CalibrationResult:
    """The result of a calibration with a sharpness held, and what was done; the robot asks for it again."""
    parameters = dict(result.robot.parameters)
    for joint in sharpness:
        name = f"{joint}.{SHARPNESS}"
        parameters[name] = replace(parameters[name], fixed=robot.parameters[name].fixed)
    said = tuple(
        f"{joint}: sticks where it stands or turns over, which no {SHARPNESS} explains; it was left at {value:.4g} "
        f"{robot.parameters[f'{joint}.{SHARPNESS}'].unit}, and only the moving joint was asked"
        for joint, value in sharpness.items()
    )
    calibrated = replace(result.robot, parameters=parameters)
    return replace(result, robot=calibrated, start=robot, findings=(*said, *result.findings))


def _squares(result: CalibrationResult, robot: Robot, joint: str) -> tuple[Array, Array]:
    """Squared residuals of the equation of a joint's motor, in units of the expected, at standstill and in motion."""
    row = robot.layout.motor_row[robot.joints.index(joint)]
    still, moving = list[Array](), list[Array]()
    for bag in result.bags:
        squares = (bag.process[:, row] / bag.process_sigma[:, row]) ** 2
        ticks = bag.ticks
        slow = leaving_standstill_out(robot, bag.recording).sticks(joint, ticks[1:], np.diff(ticks))
        judged = bag.recording.are_judged(ticks[1:], np.diff(ticks))
        still.append(squares[slow & judged])
        moving.append(squares[~slow & judged])
    return np.concatenate(still), np.concatenate(moving)
