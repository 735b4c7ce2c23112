# SPDX-License-Identifier: BSD-3-Clause
"""Random torques that last, one in each equation of motion: tau = I w, dw/dt = -w / T + white noise.

I is the inertia of the coordinate alone: of a link that of the URDF, with the rotor where the joint is rigid, of a
motor its rotor. It follows the value of the rotor that a calibration tries, so that w is what the motion needs.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


def equation_inertias(robot: Robot) -> Array:
    """I of each equation, shape (n_link + n_motor,) [kg m^2], of joints that slide [kg]."""
    layout = robot.layout
    found = np.concatenate([robot.free_inertias(), np.zeros(layout.n_motor)])
    for joint, row in zip(robot.joints, layout.motor_row.tolist(), strict=True):
        if joint not in robot.tree.massless:  # there the rotor is all that the link has
            found[row] += robot.drive_parameter(joint, "inertia").value
    return found


def lasting_torques(robot: Robot) -> dict[str, float]:
    """Standard deviation of each torque that lasts, by equation: "joint1.link" [N m], of joints that slide [N]."""
    if not robot.noise.n_lasting:
        return {}
    found = robot.noise.lasting * equation_inertias(robot)
    return dict(zip(robot.layout.rate_names, found.tolist(), strict=False))


def memory_spreads(robot: Robot) -> Array:
    """Standard deviation of each memory of the state where a recording begins, shape (n_memory,)."""
    of_effects = np.array([memory.spread for memory in robot.memories.values()])
    return np.concatenate([of_effects, robot.noise.lasting])


class LastingTorques:
    """Torques of a robot's process noise that are states.

    Args:
        robot: its noise and layout.
        parameters: of its joints.
    """

    def __init__(self, robot: Robot, parameters: JointParameters):
        layout, noise = robot.layout, robot.noise
        self._parameters, self._time, k = parameters, noise.correlation_time, noise.n_lasting
        rows = np.arange(k)
        # equation, column of w, equation of w
        self._places = list(zip(rows, layout.size - k + rows, layout.n_rates - k + rows, strict=True))
        self._motor_row = layout.motor_row if k else layout.motor_row[:0]
        self._alone = equation_inertias(robot) if k else np.zeros(0)
        self._rotors = np.array([robot.drive_parameter(joint, "inertia").value for joint in robot.joints if k])

    def add(
        self, x: Array, values: Mapping[str, float], torque: Array, by_state: Array | None, by_parameter: Array | None
    ) -> None:
        """Adds the torques and the rates of their states.

        Args:
            x: states, shape (m, d).
            values: all parameters by full name.
            torque: receives them, shape (m, r).
            by_state: receives their derivative by the state, shape (m, r, d); None where not wanted.
            by_parameter: the same by the free parameters, shape (m, r, p).
        """
        if not self._places:
            return
        inertia = self._alone.copy()
        inertia[self._motor_row] += self._parameters.of(values, "inertia") - self._rotors
        for row, column, own in self._places:
            torque[:, row] += inertia[row] * x[:, column]
            torque[:, own] -= x[:, column] / self._time
            if by_state is not None:
                by_state[:, row, column] += inertia[row]
                by_state[:, own, column] -= 1.0 / self._time
        if by_parameter is not None:
            for i, row in enumerate(self._motor_row.tolist()):
                self._parameters.add(by_parameter, "inertia", i, row, x[:, self._places[row][1]])
