# SPDX-License-Identifier: BSD-3-Clause
"""A recording seen by a robot whose parameters are known: no factor asks for derivatives by them.

States smoothed, filtered or followed with parameters that stay need none, and these are half of the work.
"""

from __future__ import annotations

from dataclasses import replace

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.model.robot import SHARPNESS, Robot


def knowing(robot: Robot) -> Robot:
    """The robot with its parameters held; where the sharpness of friction is asked for, standing motors are others."""
    held = {
        name: p if name.endswith(f".{SHARPNESS}") else replace(p, fixed=True) for name, p in robot.parameters.items()
    }
    return replace(robot, parameters=held)


def with_known_values(problem: BagProblem, calibration: Calibration) -> tuple[BagProblem, Calibration]:
    """The recording and the shared values that are left, of the robot with the values of a calibration."""
    values = calibration.by_name
    known = problem.of_robot(knowing(problem.robot.with_values(values))).with_noise(problem.dynamics.steps.noise)
    return known, carried(calibration, Calibration.of(known.robot))


def carried(found: Calibration, like: Calibration) -> Calibration:
    """All shared values but the parameters in another layout."""
    return like.with_points({name: value for name, value in found.points.items() if name != DYNAMICS})
