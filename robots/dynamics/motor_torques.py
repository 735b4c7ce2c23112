# SPDX-License-Identifier: BSD-3-Clause
"""What a motor does of its own: torque of the command, back-EMF and friction.

    tau_motor = k_pwm U u - k_mi v_motor             (eq. 11), k_t u where the command is a current,
                                                     u itself where it is a torque
    tau_friction = mu tanh(k v)                      (eq. 12), with v of the motor or of the link

Equation numbers: Schuethe, Wenk, Frese (2016).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.model.robot import SHARPNESS, Robot

Array = NDArray[np.float64]


class MotorTorques:
    """Torques of all motors.

    Args:
        robot: drives and choices.
        parameters: of its joints.
    """

    def __init__(self, robot: Robot, parameters: JointParameters):
        self._layout, self._parameters = robot.layout, parameters
        self._volts = robot.command_volts
        self._gain, self._has_back_emf = robot.drive_gain, "k_mi" in robot.drive_laws
        self._friction_on_link = robot.choices.friction_velocity == "link"
        self._sharpness = robot.friction_sharpness

    def of_command(self, u: Array, values: Mapping[str, float]) -> Array:
        """Torque of commands in their SI unit, shape (m, n) [N m]."""
        return u if self._gain is None else self._parameters.of(values, self._gain) * self._volts * u

    def add_command_slopes(self, by_parameter: Array, u: Array, inertia: Array | float = 1.0) -> None:
        """Adds the derivative of `of_command`, over an inertia where accelerations are meant.

        Args:
            by_parameter: receives it, shape (m, r, p).
            u: commands in their SI unit, shape (m, n).
            inertia: shape (n,) [kg m2], or 1 for torques.
        """
        if self._gain is None:
            return
        slopes = self._volts * u / inertia
        for i, row in enumerate(self._layout.motor_row.tolist()):
            self._parameters.add(by_parameter, self._gain, i, row, slopes[:, i])

    def add(self, terms: TorqueTerms, x: Array, values: Mapping[str, float], sharpness: Array | None = None) -> None:
        """Adds friction, and the back-EMF where the command is a voltage.

        Args:
            terms: receives them.
            x: states, shape (m, d).
            values: all parameters by full name.
            sharpness: of the friction, where it is another one than the robot's, shape (n,) or (m, n) [s/rad].
        """
        layout, parameters = self._layout, self._parameters
        mu = parameters.of(values, "coulomb_torque")
        friction_v = layout.joint_v if self._friction_on_link else layout.motor_v
        sharpness = self._sharpness(values) if sharpness is None else sharpness
        smooth_sign = np.tanh(sharpness * x[:, friction_v])
        k_mi = parameters.of(values, "k_mi") if self._has_back_emf else np.zeros(len(mu))
        v_motor = x[:, layout.motor_v]
        torque = -mu * smooth_sign - k_mi * v_motor
        for i, row in enumerate(layout.motor_row.tolist()):
            terms.value[:, row] += torque[:, i]
            if terms.by_state is None or terms.by_parameter is None:
                continue
            slope = mu[i] * (1.0 - smooth_sign[:, i] ** 2)
            terms.by_state[:, row, friction_v[i]] -= slope * sharpness[..., i]
            parameters.add(terms.by_parameter, SHARPNESS, i, row, -slope * x[:, friction_v[i]])
            terms.by_state[:, row, layout.motor_v[i]] -= k_mi[i]
            parameters.add(terms.by_parameter, "coulomb_torque", i, row, -smooth_sign[:, i])
            if self._has_back_emf:
                parameters.add(terms.by_parameter, "k_mi", i, row, -v_motor[:, i])
