# SPDX-License-Identifier: BSD-3-Clause
"""Smoothed states with short steps where dry friction turns over, as the fixed-lag estimator takes them.

Within a step in which a velocity changes its sign the collocation misses the friction's torque over up to a sixth of
the step. The states of such steps, and those beside them, are some sigmas off.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, rotation_block
from jointscope.factors.interpolated import interpolate
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

SHARP_TURN = 4.0  # change of the argument of the friction's tanh, with its sign, over a step that is halved
HALVINGS = 5


def times_of_reversals(robot: Robot, ticks: Array, x: Array) -> Array:
    """Ends of ever shorter steps around the moments at which dry friction turns over sharply, shape (k,) [s].

    Args:
        robot: its friction.
        ticks: shape (m + 1,) [s].
        x: states, shape (m + 1, d).
    """
    layout = robot.layout
    columns = layout.joint_v if robot.choices.friction_velocity == "link" else layout.motor_v
    v, sharpness = x[:, columns], robot.friction_sharpness()
    turns = (v[:-1] * v[1:] < 0.0) & (np.abs(np.diff(v, axis=0)) * sharpness > SHARP_TURN)
    steps, joints = np.nonzero(turns)
    share = v[steps, joints] / (v[steps, joints] - v[steps + 1, joints])
    found, low, high = [], np.zeros(len(steps)), np.ones(len(steps))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        found.append(ticks[steps] + middle * np.diff(ticks)[steps])
        low, high = np.where(share > middle, middle, low), np.where(share > middle, high, middle)
    return np.unique(found)


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
