# SPDX-License-Identifier: BSD-3-Clause
"""Smoothed states with short steps where dry friction turns over, as the fixed-lag estimator takes them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, rotation_block
from jointscope.factors.interpolated import interpolate
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.reversals import times_of_reversals
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate

Array = NDArray[np.float64]


def with_short_reversals(
    problem: BagProblem, x: Array, calibration: Calibration
) -> tuple[BagProblem, Array, Calibration]:
    """The smoothed problem with its steps divided where dry friction turns over, solved again; shapes as in `smooth`.

    Args:
        problem: smoothed.
        x: its states, shape (m + 1, d).
        calibration: its values; parameters and mountings stay.
    """
    robot, ticks = problem.robot, problem.timeline.ticks
    between = times_of_reversals(robot, ticks, x)
    if not len(between) or robot.choices.integrator != "simpson":
        return problem, x, calibration
    divided = BagProblem.of(robot, problem.recording, between)
    step, fraction = problem.timeline.locate(divided.timeline.ticks)
    start = interpolate(robot.layout, x[step], x[step + 1], fraction, problem.timeline.h[step])
    hold = (DYNAMICS, *(rotation_block(gyro.name) for gyro in robot.gyros))
    estimate = solve([divided], Estimate((start,), (calibration,)), hold=hold).estimate
    return divided, estimate.states[0], estimate.calibrations[0]
