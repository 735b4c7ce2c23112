# SPDX-License-Identifier: BSD-3-Clause
"""Rests linearised by values, as their likelihood is one: commands were recorded, friction and gains are linear in it.

Values above zero have coordinates that are logarithms. Those of friction and of gains are taken as they are here, with
their priors: friction may be zero, and torques are straight lines in gains however far these are off.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rests.linear_rests import LinearRests
from jointscope.graphs.rests.rest_set import RestSet
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RestsByValues:
    """The linear model of p values.

    Attributes:
        linear: by changes of the values.
        calibration: of all values, where they are.
        size: of each value by its coordinate, shape (p,).
        friction: values of the bands' widths that are above zero, shape (p,).
        straight: these and gains, shape (p,).
    """

    linear: LinearRests
    calibration: Calibration
    size: Array
    friction: NDArray[np.bool_]
    straight: NDArray[np.bool_]

    @staticmethod
    def of(problem: RestSet, robot: Robot, x: Array, calibration: Calibration) -> RestsByValues:
        """Linearises with priors.

        Args:
            problem: all rests with their weights.
            robot: with the priors of all values.
            x: states of largest likelihood, shape (m, d).
            calibration: values there, those of the robot at their start where it lacks them.
        """
        at = calibration.carried_to(Calibration.of(robot).only([DYNAMICS]))
        free = [robot.parameters[name] for name in at.names]
        prior = np.array([np.log(p.prior) if p.positive else p.prior for p in free])
        commands = replace(problem.of_robot(robot), per_command=True)
        linear = LinearRests.of(commands, x, at, np.zeros(len(free)), np.zeros(len(free)))
        friction = at.positive & np.any(linear.H != 0.0, axis=0)
        straight = friction | (at.positive & np.any(linear.G != 0.0, axis=0))
        size = at.value_by_coordinate
        weight = np.array(
            [
                1.0 / (p.prior_sigma if own else p.coordinate_sigma * each) ** 2
                for p, own, each in zip(free, straight, size, strict=True)
            ]
        )
        off = np.where(straight, at.values - np.array([p.prior for p in free]), (at.dynamics - prior) * size)
        linear = linear.per_value(size)
        linear = replace(linear, A=linear.A + np.diag(weight), b=linear.b + weight * off)
        return RestsByValues(linear, at, size, friction, straight)
