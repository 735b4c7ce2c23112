# SPDX-License-Identifier: BSD-3-Clause
"""Where the end effector is, and how well that is known: from link coordinates and their full covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.replay.replay_result import CovarianceSeries, StateSeries
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

STEP = 1e-6  # [rad] of the central difference


def link_coordinates(robot: Robot, states: StateSeries, times: Array) -> Array:
    """Link coordinates at other times, linear in between, shape (m, n_link) [rad]."""
    columns = states.mean[:, robot.layout.q_link].T
    return np.column_stack([np.interp(times, states.times, column) for column in columns])


def position_jacobian(tree: RigidTree, body: str, q: Array) -> Array:
    """Derivative of a body's position by the angles, by central differences, shape (m, 3, n) [m/rad]."""
    J = np.empty((len(q), 3, tree.n))
    for i in range(tree.n):
        step = STEP * np.eye(tree.n)[i]
        _, p_plus = tree.body_poses(body, q + step)
        _, p_minus = tree.body_poses(body, q - step)
        J[:, :, i] = (p_plus - p_minus) / (2.0 * STEP)
    return J


def tip_covariance(robot: Robot, q: Array, covariance: Array) -> Array:
    """Covariance J P J' of the last body's position, shape (m, 3, 3) [m^2].

    Args:
        robot: the model.
        q: link coordinates, shape (m, n_link) [rad].
        covariance: of q, shape (m, n_link, n_link) [rad^2].
    """
    J = position_jacobian(robot.kinematic_tree, robot.tree.bodies[-1], q)
    return J @ covariance @ J.transpose(0, 2, 1)


def tip_half_axes(robot: Robot, states: StateSeries, series: CovarianceSeries) -> Array:
    """Half axes of the 2 sigma ellipsoid, shortest first, shape (m, 3) [m]."""
    link = robot.layout.q_link
    covariance = tip_covariance(robot, link_coordinates(robot, states, series.times), series.matrices[:, link, link])
    return 2.0 * np.sqrt(np.maximum(np.linalg.eigvalsh(covariance), 0.0))
