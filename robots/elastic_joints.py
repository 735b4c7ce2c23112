# SPDX-License-Identifier: BSD-3-Clause
"""Accelerations of a robot with elastic joints, with all derivatives, for many samples at once.

    link side   M(q) a + c(q, v) + g(q) + tau_c = 0                          (eq. 1, 5)
    motor side  b a_motor = tau_c + tau_motor(u, v_motor) - tau_friction     (eq. 2, 7)
    coupling    tau_c = K (q_link - q_motor) + D (v_link - v_motor)          (eq. 6)
    motor       tau_motor = k_pwm U u - k_mi v_motor                         (eq. 11)
    friction    tau_friction = mu tanh(k v)                                  (eq. 12)

The state is x = (q_link, v_link, q_motor, v_motor). Equation numbers: Schuethe, Wenk, Frese (2016).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigidDerivatives:
    """Derivatives of the rigid bodies' accelerations by q, v and tau (M^-1), shape (m, n, n) each."""

    by_position: Array
    by_velocity: Array
    by_torque: Array

    def between(self) -> RigidDerivatives:
        """Means of neighbouring samples, shape (m - 1, n, n): off by h^2/8 of their second time derivative."""
        parts = (self.by_position, self.by_velocity, self.by_torque)
        return RigidDerivatives(*(0.5 * (part[1:] + part[:-1]) for part in parts))


@dataclass(frozen=True)
class Accelerations:
    """Accelerations of m samples and their derivatives.

    Attributes:
        value: link accelerations, then motor accelerations, shape (m, 2n) [rad/s^2].
        by_state: derivative by x, shape (m, 2n, 4n).
        by_parameter: derivative by the free parameters, each in its own unit, shape (m, 2n, p).
        rigid: the part of the derivatives that comes from the rigid bodies.
    """

    value: Array
    by_state: Array
    by_parameter: Array
    rigid: RigidDerivatives


class ElasticJoints:
    """The equations of motion of one robot.

    Args:
        robot: tree, drives and parameters.

    Attributes:
        names: names of the free parameters, in the order of every parameter vector here.
        n: number of joints.
    """

    def __init__(self, robot: Robot):
        self.n = robot.n
        self._tree = robot.tree
        self._volts = robot.command_volts
        self._torque_command = robot.command.unit == "N m"
        self._friction_on_link = robot.choices.friction_velocity == "link"
        self._sharpness = robot.choices.friction_sharpness
        self.names = tuple(name for name, parameter in robot.parameters.items() if not parameter.fixed)
        self._fixed: dict[str, Array] = {}
        self._index: dict[str, NDArray[np.intp]] = {}
        laws = ("coulomb_torque", "stiffness", "damping", "inertia")
        for law in laws if self._torque_command else (*laws, "k_pwm", "k_mi"):
            drive = [robot.drive_parameter(joint, law) for joint in robot.joints]
            self._fixed[law] = np.array([parameter.value for parameter in drive])
            self._index[law] = np.array([-1 if p.fixed else self.names.index(p.name) for p in drive])

    def accelerations(self, x: Array, u: Array, parameters: Array) -> Array:
        """Link and motor accelerations.

        Args:
            x: states, shape (m, 4n).
            u: commands in their SI unit, shape (m, n).
            parameters: values of the free parameters, shape (p,).

        Returns:
            Shape (m, 2n) [rad/s^2].
        """
        q_link, v_link, q_motor, v_motor = np.split(x, 4, axis=1)
        law = self._laws(parameters)
        tau_c = law["stiffness"] * (q_link - q_motor) + law["damping"] * (v_link - v_motor)
        a_link = self._tree.acceleration(q_link, v_link, -tau_c)
        v_friction = v_link if self._friction_on_link else v_motor
        tau_friction = law["coulomb_torque"] * np.tanh(self._sharpness * v_friction)
        a_motor = (tau_c + self._motor_torque(u, v_motor, law) - tau_friction) / law["inertia"]
        return np.hstack([a_link, a_motor])

    def with_derivatives(
        self, x: Array, u: Array, parameters: Array, rigid: RigidDerivatives | None = None
    ) -> Accelerations:
        """Link and motor accelerations with derivatives; arguments as in `accelerations` and `without_command`."""
        return self.with_command(self.without_command(x, parameters, rigid), u, parameters)

    def without_command(self, x: Array, parameters: Array, rigid: RigidDerivatives | None = None) -> Accelerations:
        """As `with_derivatives` at u = 0; the dear part, which consecutive steps share.

        Args:
            x: states, shape (m, 4n).
            parameters: values of the free parameters, shape (p,).
            rigid: derivatives of the rigid bodies where they are known well enough; the accelerations themselves are
                always exact.
        """
        n, m = self.n, len(x)
        q_link, v_link, q_motor, v_motor = np.split(x, 4, axis=1)
        law = self._laws(parameters)
        K, D, b = law["stiffness"], law["damping"], law["inertia"]
        deflection, rate = q_link - q_motor, v_link - v_motor
        tau_c = K * deflection + D * rate
        if rigid is None:
            a_link, *derivatives = self._tree.acceleration_derivatives(q_link, v_link, -tau_c)
            rigid = RigidDerivatives(*derivatives)
        else:
            a_link = self._tree.acceleration(q_link, v_link, -tau_c)
        da_dq, da_dv, M_inverse = rigid.by_position, rigid.by_velocity, rigid.by_torque
        v_friction = v_link if self._friction_on_link else v_motor
        smooth_sign = np.tanh(self._sharpness * v_friction)
        zero_command = np.zeros((1, n))
        a_motor = (tau_c + self._motor_torque(zero_command, v_motor, law) - law["coulomb_torque"] * smooth_sign) / b

        by_state = np.zeros((m, 2 * n, 4 * n))
        by_state[:, :n, :n] = da_dq - M_inverse * K
        by_state[:, :n, n : 2 * n] = da_dv - M_inverse * D
        by_state[:, :n, 2 * n : 3 * n] = M_inverse * K
        by_state[:, :n, 3 * n :] = M_inverse * D
        joint = np.arange(n)
        motor = n + joint
        by_state[:, motor, joint] = K / b
        by_state[:, motor, n + joint] = D / b
        by_state[:, motor, 2 * n + joint] = -K / b
        by_state[:, motor, 3 * n + joint] = -D / b
        if not self._torque_command:
            by_state[:, motor, 3 * n + joint] -= law["k_mi"] / b
        slope = self._sharpness * (1.0 - smooth_sign**2) * law["coulomb_torque"] / b
        by_state[:, motor, (n if self._friction_on_link else 3 * n) + joint] -= slope

        by_parameter = np.zeros((m, 2 * n, len(self.names)))
        for i in range(n):
            self._add(by_parameter, "stiffness", i, slice(0, n), -M_inverse[:, :, i] * deflection[:, i, None])
            self._add(by_parameter, "damping", i, slice(0, n), -M_inverse[:, :, i] * rate[:, i, None])
            self._add(by_parameter, "stiffness", i, n + i, deflection[:, i] / b[i])
            self._add(by_parameter, "damping", i, n + i, rate[:, i] / b[i])
            self._add(by_parameter, "coulomb_torque", i, n + i, -smooth_sign[:, i] / b[i])
            self._add(by_parameter, "inertia", i, n + i, -a_motor[:, i] / b[i])
            if not self._torque_command:
                self._add(by_parameter, "k_mi", i, n + i, -v_motor[:, i] / b[i])
        return Accelerations(np.hstack([a_link, a_motor]), by_state, by_parameter, rigid)

    def with_command(self, free: Accelerations, u: Array, parameters: Array) -> Accelerations:
        """Adds the command to the result of `without_command`.

        Args:
            free: accelerations at u = 0; not changed.
            u: commands in their SI unit, shape (m, n).
            parameters: values of the free parameters, shape (p,).
        """
        n = self.n
        law = self._laws(parameters)
        b = law["inertia"]
        torque = u if self._torque_command else law["k_pwm"] * self._volts * u
        value = free.value.copy()
        value[:, n:] += torque / b
        by_parameter = free.by_parameter.copy()
        for i in range(n):
            self._add(by_parameter, "inertia", i, n + i, -torque[:, i] / b[i] ** 2)
            if not self._torque_command:
                self._add(by_parameter, "k_pwm", i, n + i, self._volts * u[:, i] / b[i])
        return Accelerations(value, free.by_state, by_parameter, free.rigid)

    def _motor_torque(self, u: Array, v_motor: Array, law: dict[str, Array]) -> Array:
        if self._torque_command:
            return np.broadcast_to(u, v_motor.shape)
        return law["k_pwm"] * self._volts * u - law["k_mi"] * v_motor

    def _laws(self, parameters: Array) -> dict[str, Array]:
        """Each law's parameter for every joint, shape (n,)."""
        padded = np.append(parameters, np.nan)
        return {law: np.where(i < 0, self._fixed[law], padded[i]) for law, i in self._index.items()}

    def _add(self, by_parameter: Array, law: str, joint: int, rows: slice | int, column: Array) -> None:
        index = self._index[law][joint]
        if index >= 0:
            by_parameter[:, rows, index] += column
