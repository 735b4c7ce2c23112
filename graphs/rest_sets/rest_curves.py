# SPDX-License-Identifier: BSD-3-Clause
"""Curves that rests tell: torque over deflection of each spring, friction over load of each motor, with sigmas.

They are Fig. 4 and Fig. 5 of Ho and Kisner, in motor coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.robots.bodies.known_loads import KnownLoads, known_loads
from jointscope.robots.dynamics.at_rest import WithSlopes, at_rest
from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.at_encoders import acting_commands

Array = NDArray[np.float64]
GRID = 81  # points of a spring's curve


@dataclass(frozen=True)
class MeasuredCurve:
    """A curve with its band, and what was measured.

    Attributes:
        joint: whose.
        x, y, sigma: of the curve, shape (k,).
        points_x, points_y: shape (m,).
    """

    joint: str
    x: Array
    y: Array
    sigma: Array
    points_x: Array
    points_y: Array


def spring_curves(problems: Sequence[RestSet], covariance: Array) -> list[MeasuredCurve]:
    """Torque of each spring on its motor [N m] over its deflection [rad].

    Measured: deflection of the encoders and the torque of gravity and known loads, friction having no part in it.

    Args:
        problems: with the calibrated robot.
        covariance: of the values of its free parameters, shape (p, p).
    """
    robot = problems[0].robot
    values = robot.values
    deflections, torques = [], []
    for problem in problems:
        if problem.rests.q_link is None:
            return []
        x = _states(problem)
        seen = problem.model.seen(x, values)
        deflections.append(seen[:, robot.layout.joint_q] - seen[:, robot.layout.motor_q])
        torques.append(_carried(problem, x, values))
    d, tau = np.concatenate(deflections), np.concatenate(torques)
    model, calibration = problems[0].model, Calibration.of(robot)
    found = []
    for j in robot.layout.elastic_joints:
        grid = np.linspace(d[:, j].min(), d[:, j].max(), GRID)
        positions = np.zeros((GRID, robot.layout.size))
        positions[:, robot.layout.motor_q[j]] = -grid
        nothing = KnownLoads(np.zeros((GRID, robot.layout.n_link)), np.zeros((GRID,) + (robot.layout.n_link,) * 2))
        torque = at_rest(
            model, positions[:, robot.layout.positions], np.zeros((GRID, robot.n)), calibration.values, nothing
        ).motors
        found.append(
            MeasuredCurve(robot.joints[j], grid, torque.value[:, j], _sigma(torque, j, covariance), d[:, j], tau[:, j])
        )
    return found


def friction_curves(problems: Sequence[RestSet], covariance: Array) -> list[MeasuredCurve]:
    """Half width of each motor's band [N m] over the size of its load [N m]; measured is what friction held.

    Arguments as of `spring_curves`.
    """
    robot = problems[0].robot
    values = robot.values
    calibration = Calibration.of(robot)
    load, held, moved, half, sigma = [], [], [], [], []
    for problem in problems:
        states = problem.start(calibration)[0]
        torques = problem.torques(states, calibration)
        carried = _carried(problem, _states(problem), values)
        drive = torques.held.value
        acting, _ = acting_commands(robot, problem.rests.u, values)
        if problem.rests.q_link is None:
            return []
        # the spring's torque is known better from what hangs on it than from encoders
        standing = np.abs(problem.model.drive_gain(calibration.values) * acting + carried)
        largest = np.abs(problem.bands(states, torques, calibration).y)  # where links swung on, at a turning point
        swung = largest > np.abs(drive)
        held.append(np.where(swung, largest, standing) if _elastic(robot) else np.abs(drive))
        load.append(np.abs(carried))
        moved.append(problem.rests.moved)
        half.append(torques.half.value)
        sigma.append(np.stack([_sigma(torques.half, j, covariance) for j in range(robot.n)], axis=1))
    s, y, m, h, e = (np.concatenate(part) for part in (load, held, moved, half, sigma))
    found = []
    for j, joint in enumerate(robot.joints):
        order, told = np.argsort(s[:, j]), m[:, j]
        found.append(MeasuredCurve(joint, s[order, j], h[order, j], e[order, j], s[told, j], y[told, j]))
    return found


def _elastic(robot: Robot) -> bool:
    return len(robot.layout.motors) == robot.n


def _states(problem: RestSet) -> Array:
    """States where the encoders say, shape (m, d)."""
    positions, _ = problem.start(Calibration.of(problem.robot))
    x = np.zeros((len(positions), problem.robot.layout.size))
    x[:, problem.robot.layout.positions] = positions
    return x


def _carried(problem: RestSet, x: Array, values: dict[str, float]) -> Array:
    """What the gears carry, in motor coordinates, shape (m, n) [N m]."""
    robot, rests = problem.robot, problem.rests
    loads = known_loads(robot.kinematic_tree, rests.links, rests.forces, x[:, robot.layout.q_link])
    return CarriedWeight(robot).torque(x, values, loads.torque[:, robot.layout.joint_link])


def _sigma(part: WithSlopes, j: int, covariance: Array) -> Array:
    by = part.by_parameter[:, j]
    return np.asarray(np.sqrt(np.einsum("kp,pq,kq->k", by, covariance, by)))
