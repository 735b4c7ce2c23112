# SPDX-License-Identifier: BSD-3-Clause
"""Feedback gains from the model alone: the linear-quadratic regulator at poses along the planned motion.

The model is linearised by secants, not tangents: Coulomb friction, dead bands and backlash have slopes at their kinks
that say nothing about a motion. What counts is said once for all robots: which error of a link is worth the full
command.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, expm, solve_discrete_are

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.planning.reference import Reference, parameter_values

Array = NDArray[np.float64]

WORTH_FULL_COMMAND = (0.05, 0.5)  # [rad], [rad/s] of a link
SPAN = (0.05, 0.5)  # [rad], [rad/s] half widths of the secants
EVERY = 0.05  # [s] between poses


class OptimalGains:
    """Gains along a reference, u = u_ref - gain (x - x_ref).

    Args:
        robot: the model.
        reference: states of the plan.
        step: between ticks [s].
        full: the full command of each joint, shape (n_joints,).

    Raises:
        SimulationError: the linearised model cannot be controlled.
    """

    def __init__(self, robot: Robot, reference: Reference, step: float, full: Array):
        self._stride = max(1, round(EVERY / step))
        self._columns = np.concatenate([robot.layout.positions, robot.layout.velocities])
        poses = reference.x[:: self._stride]
        A, B = linearised(robot, poses, self._columns)
        found: dict[bytes, Array] = {}
        self._gains = np.zeros((len(poses), robot.n, robot.layout.size))
        for k, x in enumerate(poses):
            key = np.round(x, 4).tobytes()  # the robot is at home again and again
            if key not in found:
                found[key] = _regulator(robot, A[k], B[k], step, full)
            self._gains[k][:, self._columns] = found[key]

    def at(self, tick: int) -> Array:
        """The gain of the nearest pose, shape (n_joints, d)."""
        return self._gains[min(round(tick / self._stride), len(self._gains) - 1)]


def linearised(robot: Robot, x: Array, columns: NDArray[np.intp]) -> tuple[Array, Array]:
    """dx/dt = A x + B u for positions and velocities about states of shape (k, d): (k, c, c) and (k, c, n_joints)."""
    model, half = ElasticJoints(robot), len(columns) // 2
    parameters, no_command = parameter_values(model, robot), np.zeros((len(x), robot.n))
    A = np.zeros((len(x), 2 * half, 2 * half))
    A[:, :half, half:] = np.eye(half)
    for i, column in enumerate(columns):
        nudge = np.zeros(x.shape[1])
        nudge[column] = SPAN[0] if i < half else SPAN[1]
        plus, minus = (model.accelerations(x + sign * nudge, no_command, parameters) for sign in (1.0, -1.0))
        A[:, half:, i] = (plus - minus)[:, :half] / (2.0 * nudge[column])
    B = np.zeros((len(x), 2 * half, robot.n))
    derivatives = model.with_derivatives(x, no_command, parameters)
    B[:, half:] = model.command_response(derivatives, parameters)[:, :half]
    return A, B


def _regulator(robot: Robot, A: Array, B: Array, step: float, full: Array) -> Array:
    """The gain of one pose, shape (n_joints, c)."""
    size, n, layout = len(A), robot.n, robot.layout
    held = expm(step * np.block([[A, B], [np.zeros((n, size + n))]]))
    weight = np.full(size, 1e-9)  # nothing is worth nothing, or a free rotor could drift unseen
    weight[layout.joint_link] = WORTH_FULL_COMMAND[0] ** -2
    weight[size // 2 + layout.joint_link] = WORTH_FULL_COMMAND[1] ** -2
    A_step, B_step, R = held[:size, :size], held[:size, size:], np.diag(full**-2.0)
    try:
        P = solve_discrete_are(A_step, B_step, np.diag(weight), R)
    except (LinAlgError, ValueError) as err:
        raise SimulationError(
            f"robot {robot.name!r}: its model admits no state feedback ({err}); check stiffness, damping and inertia"
        ) from err
    return np.asarray(np.linalg.solve(R + B_step.T @ P @ B_step, B_step.T @ P @ A_step))
