# SPDX-License-Identifier: BSD-3-Clause
"""Values that act by speed alone: rests do not tell them, though motors that creep move.

A motor that creeps does so a thousand times slower than it works, by a friction that turns over into stick and slip
there. A viscous coefficient of this speed is none of the motion that the robot file is for, and what is written into
the file would be used for it. So these values stay what they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.rests import Rests

Array = NDArray[np.float64]
NOTHING = 1e-3  # of the slope where motors creep: bands are those at a speed that is nearly none


def without_motion(robot: Robot, recordings: Sequence[Rests]) -> tuple[Robot, tuple[str, ...]]:
    """The robot with values held that act on nothing but motors that creep, and their names.

    Args:
        robot: with start values.
        recordings: rests of each.
    """
    calibration, told, moving = Calibration.of(robot), set[str](), set[str]()
    for rests in recordings:
        if not np.any(rests.creep):
            continue
        problem = RestSet.of(robot, rests)
        x, at = problem.start(calibration)
        torques = problem.torques(x, at)
        for k, name in enumerate(at.names):
            still = (torques.links, torques.motors, torques.middle, torques.half)
            sliding = float(np.abs(torques.sliding.by_parameter[:, :, k]).max(initial=0.0))
            if any(np.any(np.abs(part.by_parameter[:, :, k]) > NOTHING * sliding) for part in still):
                told.add(name)
            elif sliding > 0.0:
                moving.add(name)
    names = tuple(name for name in calibration.names if name in moving - told)
    held = {name: replace(robot.parameters[name], fixed=True) for name in names}
    return replace(robot, parameters={**robot.parameters, **held}), names


def as_given(robot: Robot, given: Robot, names: Sequence[str]) -> Robot:
    """A robot whose values of these names are as they were given."""
    return replace(robot, parameters={**robot.parameters, **{name: given.parameters[name] for name in names}})


def with_priors(covariance: Array, names: Sequence[str], robot: Robot) -> Array:
    """Covariance of all free values of a robot, those that are not among `names` as their priors have them."""
    every = Calibration.of(robot)
    sigmas = np.array([robot.parameters[name].coordinate_sigma for name in every.names]) * every.value_by_coordinate
    wide = np.diag(sigmas**2)
    place = [every.names.index(name) for name in names]
    wide[np.ix_(place, place)] = covariance
    return wide
