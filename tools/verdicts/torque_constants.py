# SPDX-License-Identifier: BSD-3-Clause
"""Whether torque constants that a recording tells may be those of drives, or speak of wrong masses.

With gravity or known inertias, a recording tells how many N m one unit of the command makes, by the masses of the
URDF. Joints of a robot are unlike, and so are their drives and gears: constants that are all the same number, and not
one, are what masses in grams, masses that are off by one factor, or torques before gears of one ratio look like. All
values then are wrong by that factor, and no residual shows it.
"""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.model.command_words import init_command

ALIKE = 0.1  # relative; masses are not off by exactly one factor, nor are inertias off with them
UNITS = 1000.0  # from grams to kilograms
AMPERES = "If the drives take amperes and are alike, write `confirmed: true` below `unit: A` in the robot file"
NEAR = 0.25  # relative; of a constant of a lone joint to that ratio


def suspicious_constants(result: CalibrationResult) -> str:
    """What speaks against the torque constants, with what to do; empty where nothing does."""
    robot = result.robot
    law = robot.drive_gain
    if law != "torque_constant" or robot.command.confirmed:
        return ""
    told = [p for p in result.parameters if p.name.endswith(f".{law}") and p.value > 0.0]
    values = np.array([p.value for p in told])
    if not told or len(told) < robot.n:
        return ""
    middle = float(np.median(values))
    grams = abs(abs(np.log(middle)) - np.log(UNITS)) < np.log1p(NEAR)
    if not grams and (len(told) < 2 or np.max(np.abs(values - middle)) > ALIKE * middle):
        return ""
    bag = result.bags[0].recording.path if result.bags else "BAG"
    confirmed = init_command(result.start, bag, "anew", unit="A")
    where = f"on all {len(told)} joints" if len(told) > 1 else f"on {robot.joints[0]}"
    if abs(middle - 1.0) < ALIKE:
        torque = init_command(result.start, bag, "anew", unit="Nm")
        return (
            f"One unit of the command makes {middle:.3g} N m {where}: it is a torque, then, in N m: `{torque}` says "
            f"so. {AMPERES} (or `{confirmed}`) and calibrate again."
        )
    masses = f"the masses of {robot.tree.urdf.name} are {middle:.3g} times what they should be"
    gears = "" if grams else f", or torques before gears of that ratio (`unit: N m` and `scale: {middle:.3g}`)"
    return (
        f"One unit of the command makes {middle:.3g} N m {where}. Unlike joints rarely have drives that are alike: if "
        f"commands are in N m, {masses}{' (in grams?)' if grams else ''}{gears}, and all values are wrong by as much. "
        f"{AMPERES} (or `{confirmed}`) and calibrate again."
    )
