# SPDX-License-Identifier: BSD-3-Clause
"""Motion and load of the joints over time, as a model sees them: what errors are held against.

Smoothed states tell when a joint reverses or is loaded. Signals that errors are correlated with come from predicted
states instead: a smoothed state has already taken in part of the error that it is to explain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import motor_angles
from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class JointStates:
    """Motion of n joints at m instants.

    Attributes:
        times: strictly increasing, shape (m,) [s].
        q: motor positions in link units, shape (m, n) [rad]; the link's position swings about them.
        v: motor velocities in link units, shape (m, n) [rad/s].
        deflection: q_link - q_motor, with q_link as the motor sees it, shape (m, n) [rad]; NaN where it is not known.
        load: torque in the spring, K deflection + D rate, shape (m, n) [N m]; NaN where it is not known.
    """

    times: Array
    q: Array
    v: Array
    deflection: Array
    load: Array

    @staticmethod
    def of(robot: Robot, times: Array, x: Array) -> JointStates:
        """From states of the robot.

        Args:
            robot: the model.
            times: strictly increasing, shape (m,) [s].
            x: states, shape (m, d).
        """
        q_link, v_link, q_motor, v_motor = np.split(_by_joint(robot, x), 4, axis=1)
        q_link, v_link = motor_angles(robot, q_link), motor_angles(robot, v_link)
        stiffness, damping = _springs(robot)
        load = stiffness * (q_link - q_motor) + damping * (v_link - v_motor)
        return JointStates(times, q_motor, v_motor, q_link - q_motor, load)

    @staticmethod
    def of_positions(times: Array, q: Array) -> JointStates:
        """From positions alone, for example predicted encoder readings, shape (m, n) [rad]."""
        v = np.gradient(q, times, axis=0) if len(times) > 1 else np.zeros_like(q)
        unknown = np.full_like(q, np.nan)
        return JointStates(times, q, v, unknown, unknown)

    def at(self, times: Array) -> JointStates:
        """The same at other times, linear in between, shape (k,) [s]."""
        parts = (
            np.column_stack([np.interp(times, self.times, column) for column in part.T])
            for part in (self.q, self.v, self.deflection, self.load)
        )
        return JointStates(times, *parts)


def _by_joint(robot: Robot, x: Array) -> Array:
    """(q_link, v_link, q_motor, v_motor) of the joints alone, shape (m, 4n)."""
    return robot.layout.by_joint(x)


def _springs(robot: Robot) -> tuple[Array, Array]:
    """Stiffness and damping of every joint, shape (n,) each; NaN where the joint has no spring."""
    parameters = JointParameters(robot)
    values = robot.values
    known = [bool(parameters.source("stiffness", i)) for i in range(robot.n)]
    stiffness, damping = (np.where(known, parameters.of(values, law), np.nan) for law in ("stiffness", "damping"))
    return stiffness, damping
