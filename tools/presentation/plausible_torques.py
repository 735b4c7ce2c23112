# SPDX-License-Identifier: BSD-3-Clause
"""Whether masses of the URDF and torques of the commands can both be right: a fit does not show a common factor.

With all masses times a factor, every constant, inertia and friction comes out times the same factor, and the residuals
are as small as before. Two things tell: bodies that are denser than steel, and commands in N m of which one makes more
or less than one. Constants of currents are looked at by torque_constants.py.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.starts.drive_regression import Value
from jointscope.robots.bodies.possible_masses import impossible_masses
from jointscope.tools.presentation.numbers import significant

CONSTANT = "torque_constant"
MASSES = (0.05, 0.25)  # share by which one N m of the command may be off: fine up to the first, bad beyond the second
SURE = 3.5  # [sigma]
ALIKE = 0.1  # share by which constants of drives may differ that are one number, in spite of wrong moments
STRONGEST = 500.0  # [N m/A] behind the largest gears of industrial robots


def plausible_torques(result: CalibrationResult) -> tuple[str, str]:
    """A level of `judgement.LEVELS` and a sentence."""
    robot = result.robot
    if robot.free_links:
        return "info", "Without masses there is nothing to compare torques with."
    constants = [p for p in result.parameters if p.name in {f"{joint}.{CONSTANT}" for joint in robot.joints}]
    heavy = impossible_masses(robot.tree.model)
    if heavy is not None:
        grams = f"; in grams they would be 1000 times too large{_by_thousand(constants)}"
        return "bad", (
            f"link {heavy.link} of {robot.tree.urdf.name} has {significant(heavy.mass)} kg, and what moves weighs at "
            f"least {heavy.density:,.0f} kg/m3 (steel 7,900): its masses cannot be right{grams}. Mend <mass> and "
            f"<inertia> there, then {_again(result)}."
        )
    strong = max(constants, key=lambda p: p.value, default=None)
    if strong is not None and strong.value > STRONGEST and strong.unit == "N m/A":
        return "bad", (
            f"{strong.name} is {significant(strong.value)} N m/A, more than any drive makes: masses of "
            f"{robot.tree.urdf.name} in grams, or commands in another unit? Mend it, then {_again(result)}."
        )
    return _torques(result) or ("good", "Nothing speaks against the masses of the URDF.")


def _torques(result: CalibrationResult) -> tuple[str, str] | None:
    """Commands in N m: by regression one of them makes one, or masses and torques do not go together."""
    robot = result.robot
    if robot.command.unit != "N m":
        return None
    found = {joint: result.regressed.get(f"{joint}.{CONSTANT}") for joint in robot.joints}
    off = {j: v for j, v in found.items() if v is not None and abs(v.value - 1.0) > max(MASSES[0], SURE * v.sigma)}
    if not off:
        return None
    worst = max(off, key=lambda joint: _factor(off[joint]))
    known = [v.value for v in found.values() if v is not None]
    text = (
        f"The command is in N m, but with the masses of {robot.tree.urdf.name} one moves as "
        f"{', '.join(f'{significant(v.value)} ({j})' for j, v in off.items())} N m would: masses or torques are wrong "
        f"by that factor{_one_factor(known)}. Mend the masses, or say what the command is: "
        f"{_again(result, ' --unit A')}."
    )
    return ("bad" if _factor(off[worst]) > 1.0 + MASSES[1] else "warn"), text


def _factor(value: Value) -> float:
    return float("inf") if value.value <= 0.0 else max(value.value, 1.0 / value.value)


def _by_thousand(constants: list[ParameterEstimate]) -> str:
    """What the constants would be with masses a thousand times smaller."""
    if not constants:
        return ""
    listed = ", ".join(f"{significant(p.value / 1000.0)}" for p in constants)
    return f", and constants {listed} instead of {', '.join(significant(p.value) for p in constants)}"


def _one_factor(values: list[float]) -> str:
    middle = float(np.median(values))
    alike = len(values) > 1 and bool(np.all(np.abs(np.array(values) - middle) <= ALIKE * abs(middle)))
    return f"; alike at all joints, so masses times {significant(1.0 / middle)} would fit" if alike and middle else ""


def _again(result: CalibrationResult, option: str = "") -> str:
    """The command that begins anew."""
    bag = Path(result.bags[0].recording.path).name if result.bags else "BAG"
    robot = result.start.path.name
    return f"`jointscope init {result.robot.tree.urdf.name} {bag} -o {robot}{option}`"
