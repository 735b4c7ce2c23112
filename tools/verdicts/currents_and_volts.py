# SPDX-License-Identifier: BSD-3-Clause
"""Do currents and volts tell the same torque: the back-EMF that currents show is a part of the damping, never more?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.model.motor_currents import MotorCurrents
from jointscope.tools.presentation.numbers import significant

Array = NDArray[np.float64]

NAME = "Torque from currents and from volts"
SURE = 3.0  # [sigma] by which a back-EMF must exceed the damping
MORE = 0.02  # of the damping, by which it must, too
SUPPLY = 0.05  # of a volt, beyond which it is told that it is another one


def currents_and_volts(result: CalibrationResult) -> list[tuple[str, str, str]]:
    """Level, name and sentence; none where no currents were measured beside volts."""
    robot = result.robot
    sensor = robot.motor_current
    if sensor is None or "k_mi" not in robot.drive_laws:
        return []
    law, table = MotorCurrents(robot, sensor), {p.name: p.sigma for p in result.parameters}
    constants, lost = law.constants(robot.values)
    parts, wrong = list[str](), list[str]()
    for j, joint in enumerate(robot.joints):
        damping = robot.drive_parameter(joint, "k_mi")
        back_emf = float(constants[j] * lost[j])
        sources = law.sources(j)
        relative = [table.get(name, 0.0) / abs(robot.parameters[name].value) for name in sources]
        sigma = float(np.hypot(back_emf * np.linalg.norm(relative), table.get(damping.name, 0.0)))
        rest = damping.value - back_emf
        if rest < -max(SURE * sigma, MORE * abs(damping.value)):
            wrong.append(
                f"{joint} ({significant(back_emf)} of back-EMF, {significant(damping.value)} {damping.unit} of damping)"
            )
        share = 100.0 * back_emf / damping.value if damping.value > 0.0 else np.inf
        parts.append(
            f"{joint} {share:.0f} % (the rest {significant(rest, 2)} ± {significant(sigma, 1)} {damping.unit})"
        )
    if wrong:
        text = (
            f"Currents show more back-EMF than the motion shows damping: {', '.join(wrong)}. Torque per ampere, supply "
            f"voltage or a unit is wrong; where the supply is not what the file says, "
            f"`{sensor.back_emf(robot.joints[0])}` under `parameters` lets the currents tell their own back-EMF."
        )
        return [("warn", NAME, text)]
    text = f"Back-EMF is a part of each motor's damping: {', '.join(parts)}."
    supply = _supply(result, lost)
    if supply:
        return [("warn", NAME, f"{supply} {text}")]
    return [("good", NAME, text)]


def _supply(result: CalibrationResult, lost: Array) -> str:
    """What one volt of the command is by the back-EMF, where that is another one."""
    robot, table = result.robot, {p.name: p.sigma for p in result.parameters}
    sensor = robot.motor_current
    assert sensor is not None
    said = []
    for j, joint in enumerate(robot.joints):
        own, gain = sensor.back_emf(joint), robot.drive_parameter(joint, "k_pwm")
        if own not in robot.parameters or gain.value <= 0.0:
            continue
        volts = gain.value / float(lost[j])
        relative = (table.get(own, 0.0) / lost[j], table.get(gain.name, 0.0) / gain.value)
        sigma = volts * float(np.hypot(*relative))
        if abs(volts - 1.0) > max(SURE * sigma, SUPPLY):
            said.append(f"{significant(volts)} ± {significant(sigma, 1)} by {joint}")
    if not said:
        return ""
    place = "motor.supply_voltage" if robot.command.unit == "duty" else "the unit or scale of the command"
    return f"One volt of the command is {', '.join(said)} in truth: {place} is off by that, and k_pwm with it."
