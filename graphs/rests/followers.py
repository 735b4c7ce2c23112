# SPDX-License-Identifier: BSD-3-Clause
"""Values that follow friction and gains from where rests are likeliest to their means.

Means of friction and of gains lie beyond the most likely values (band_posterior.py), and what springs do there is one
linear step away. Where values of springs trade off against each other along a curve, as the stiffness does with a curve
that multiplies it, that step leaves the curve, and links would rest where no encoder has seen them. Then springs are
solved for anew with all else at its mean.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_sets.rest_errors import rest_errors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.taken_for_granted import all_rigid
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.effect_kinds.joint_torque import is_spring_law
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
FAR = 1.05  # times the error of links where rests are likeliest, or what their encoders explain
MOST_ITERATIONS = 30


def with_followers(whole: RestSet, robot: Robot, x: Array, likeliest: Calibration, mean: Calibration) -> Calibration:
    """The means, with springs that let links rest where they were seen.

    Args:
        whole: all rests with their weights.
        robot: with the priors.
        x: states of largest likelihood, shape (m, d).
        likeliest: values there.
        mean: means by one linear step from there.
    """
    if all_rigid(robot):
        return mean
    least, there = (_error(whole, robot, at) for at in (likeliest, mean))
    if there <= FAR * max(least, 1.0):
        return mean
    springs = _of_springs(robot)
    held = {name: value for name, value in mean.by_name.items() if name not in springs}
    begun = robot.with_values({**likeliest.by_name, **held})
    parameters = {name: replace(p, fixed=p.fixed or name in held) for name, p in begun.parameters.items()}
    rests = whole.of_robot(replace(begun, parameters=parameters))
    start = Calibration.of(rests.robot).only([DYNAMICS])
    try:
        solution = solve([rests], Estimate((x,), (start,)), max_iterations=MOST_ITERATIONS)
    except SolveError:
        return mean
    found = solution.estimate.calibrations[0].carried_to(mean)
    return found if _error(whole, robot, found) < there else mean


def _of_springs(robot: Robot) -> set[str]:
    """Full names of stiffnesses and of the values of springs' laws."""
    laws = [e for e in robot.effects if is_spring_law(e.effect)]
    own = {e.parameter(p.name) for e in laws for p in e.effect.parameters_at(robot, e.owner)}
    return own | {f"{joint}.stiffness" for joint in robot.joints}


def _error(whole: RestSet, robot: Robot, at: Calibration) -> float:
    """Root mean square of how far links rest from where they were seen [sigma of their encoders]."""
    return rest_errors([whole.of_robot(robot.with_values(at.by_name))]).error
