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
    calibration = Calibration.of(robot)
    still, sliding = np.zeros((2, len(calibration.names)))
    for rests in recordings if any(np.any(rests.creep) for rests in recordings) else ():
        problem = RestSet.of(robot, rests)
        torques = problem.torques(*problem.start(calibration))
        for part in (torques.links, torques.motors, torques.middle, torques.half):
            still = np.maximum(still, np.abs(part.by_parameter).max(axis=(0, 1), initial=0.0))
        creeping = torques.sliding.by_parameter[rests.creep != 0.0]
        sliding = np.maximum(sliding, np.abs(creeping).max(axis=0, initial=0.0))
    alone = (sliding > 0.0) & (still <= NOTHING * sliding)
    names = tuple(name for name, each in zip(calibration.names, alone.tolist(), strict=True) if each)
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
