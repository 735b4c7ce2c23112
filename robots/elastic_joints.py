# SPDX-License-Identifier: BSD-3-Clause
"""Accelerations of a robot with elastic joints, with all derivatives, for many samples at once.

    link side   M(q) a + c(q, v) + g(q) + tau_c = tau_link effects                      (eq. 1, 5)
    motor side  b a_motor = tau_c + tau_motor(u, v_motor) - tau_friction + effects      (eq. 2, 7)
    coupling    tau_c = K (q_link - q_motor) + D (v_link - v_motor) + effects           (eq. 6)
    motor       tau_motor = k_pwm U u - k_mi v_motor                                    (eq. 11)
    friction    tau_friction = mu tanh(k v)                                             (eq. 12)
    bearing     tau = -q / compliance - damping v   on each hinge of a soft bearing

A rigid joint has no motor side: its motor torque and inertia act on the link. Equation numbers: Schuethe, Wenk,
Frese (2016).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.effect_torques import EffectTorques, Springs
from jointscope.robots.robot import Robot
from jointscope.robots.structured_tree import StructuredTree
from jointscope.robots.torque_terms import TorqueTerms

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigidDerivatives:
    """Derivatives of the rigid bodies' accelerations by q, v and tau (M^-1), shape (m, n_link, n_link) each."""

    by_position: Array
    by_velocity: Array
    by_torque: Array

    def between(self) -> RigidDerivatives:
        """Means of neighbouring samples, shape (m - 1, ...): off by h^2/8 of their second time derivative."""
        parts = (self.by_position, self.by_velocity, self.by_torque)
        return RigidDerivatives(*(0.5 * (part[1:] + part[:-1]) for part in parts))


@dataclass(frozen=True)
class Accelerations:
    """Accelerations of m samples and their derivatives.

    Attributes:
        value: link accelerations, motor accelerations, rates of memories, shape (m, r) [rad/s^2].
        by_state: derivative by x, shape (m, r, d).
        by_parameter: derivative by the free parameters, each in its own unit, shape (m, r, p).
        rigid: the part of the derivatives that comes from the rigid bodies.
    """

    value: Array
    by_state: Array
    by_parameter: Array
    rigid: RigidDerivatives


class ElasticJoints:
    """The equations of motion of one robot.

    Args:
        robot: tree, drives, effects and parameters.

    Attributes:
        names: names of the free parameters, in the order of every parameter vector here.
        layout: of the state.
    """

    def __init__(self, robot: Robot):
        self.layout = layout = robot.layout
        self._tree = StructuredTree(robot)
        self._volts = robot.command_volts
        self._torque_command = robot.command.unit == "N m"
        self._friction_on_link = robot.choices.friction_velocity == "link"
        self._sharpness = robot.choices.friction_sharpness
        self.names = tuple(name for name, parameter in robot.parameters.items() if not parameter.fixed)
        self._values = {name: parameter.value for name, parameter in robot.parameters.items()}
        self._find_laws(robot)
        self._elastic = np.flatnonzero([joint in layout.motors for joint in robot.joints])
        self._own_motor = np.array([layout.n_link + layout.motors.index(robot.joints[i]) for i in self._elastic], int)
        # equation in which each motor's torque stands
        self._motor_row = layout.joint_link.copy()
        self._motor_row[self._elastic] = self._own_motor
        self._effects = EffectTorques(robot.effects, robot.joints, layout, self.names, self._sharpness)
        self._bearings = [h for h in robot.effects if isinstance(h.effect, Structure) and h.effect.form == "bearing"]

    @property
    def tree(self) -> StructuredTree:
        """The rigid bodies."""
        return self._tree

    def accelerations(self, x: Array, u: Array, parameters: Array) -> Array:
        """Link and motor accelerations, and rates of memories.

        Args:
            x: states, shape (m, d).
            u: commands in their SI unit, shape (m, n).
            parameters: values of the free parameters, shape (p,).

        Returns:
            Shape (m, r) [rad/s^2].
        """
        values = self.named(parameters)
        terms = self._terms(x, values, derivatives=False)
        terms.value[:, self._motor_row] += self._drive(u, values)
        return self._solve(x, terms, values)[0]

    def with_derivatives(
        self, x: Array, u: Array, parameters: Array, rigid: RigidDerivatives | None = None
    ) -> Accelerations:
        """Accelerations with derivatives; arguments as in `accelerations` and `without_command`."""
        if self._commands_move_links:
            return self._differentiate(x, parameters, rigid, u)
        return self.with_command(self.without_command(x, parameters, rigid), u, parameters)

    def at_ticks(
        self, x: Array, u: Array, parameters: Array
    ) -> tuple[Accelerations, Accelerations, RigidDerivatives | None]:
        """Accelerations at the beginning and the end of m steps, with the command of each step.

        Args:
            x: states at the m + 1 ticks, shape (m + 1, d).
            u: commands of the m steps, shape (m, n).
            parameters: values of the free parameters, shape (p,).

        Returns:
            Both, and the rigid bodies' derivatives between the ticks where they are cheap to know.
        """
        if self._commands_move_links:
            first, last = (self._differentiate(part, parameters, None, u) for part in (x[:-1], x[1:]))
            return first, last, None
        free = self.without_command(x, parameters)
        first, last = (self.with_command(_part(free, part), u, parameters) for part in (slice(None, -1), slice(1, None)))
        return first, last, free.rigid.between()

    def without_command(self, x: Array, parameters: Array, rigid: RigidDerivatives | None = None) -> Accelerations:
        """As `with_derivatives` at u = 0; the dear part, which consecutive steps share.

        Args:
            x: states, shape (m, d).
            parameters: values of the free parameters, shape (p,).
            rigid: derivatives of the rigid bodies where they are known well enough; the accelerations themselves are
                always exact.
        """
        return self._differentiate(x, parameters, rigid, None)

    def with_command(self, free: Accelerations, u: Array, parameters: Array) -> Accelerations:
        """Adds the command to the result of `without_command`; for robots without rigid joints.

        Args:
            free: accelerations at u = 0; not changed.
            u: commands in their SI unit, shape (m, n).
            parameters: values of the free parameters, shape (p,).
        """
        values = self.named(parameters)
        b, rows, torque = self._law(values, "inertia"), self._motor_row, self._drive(u, values)
        value, by_parameter = free.value.copy(), free.by_parameter.copy()
        value[:, rows] += torque / b
        for i, row in enumerate(rows):
            self._add(by_parameter, "inertia", i, row, -torque[:, i] / b[i] ** 2)
            if not self._torque_command:
                self._add(by_parameter, "k_pwm", i, row, self._volts * u[:, i] / b[i])
        return Accelerations(value, free.by_state, by_parameter, free.rigid)

    def drive_gain(self, parameters: Array) -> Array:
        """Torque of each motor per unit of its command, shape (n,) [N m / unit]."""
        return self._drive(np.ones((1, len(self._motor_row))), self.named(parameters))[0]

    def motor_inertia(self, values: Mapping[str, float]) -> Array:
        """Inertia of each motor, shape (n,) [kg m2]."""
        return self._law(values, "inertia")

    def command_response(self, accelerations: Accelerations, parameters: Array) -> Array:
        """Derivative of the accelerations by the command of each joint, shape (m, r, n)."""
        layout, gain = self.layout, self.drive_gain(parameters)
        response = np.zeros((len(accelerations.value), layout.n_rates, len(gain)))
        b = self._law(self.named(parameters), "inertia")
        for i, row in enumerate(self._motor_row):
            if row >= layout.n_link:
                response[:, row, i] = gain[i] / b[i]
            else:
                response[:, : layout.n_link, i] = accelerations.rigid.by_torque[:, :, row] * gain[i]
        return response

    @property
    def _commands_move_links(self) -> bool:
        """Whether a command accelerates a link at once, as the motor of a rigid joint does."""
        return len(self._elastic) < len(self._motor_row)

    def _differentiate(
        self, x: Array, parameters: Array, rigid: RigidDerivatives | None, u: Array | None
    ) -> Accelerations:
        layout, values = self.layout, self.named(parameters)
        terms = self._terms(x, values, derivatives=True)
        if u is not None:
            terms.value[:, self._motor_row] += self._drive(u, values)
            for i, row in enumerate(self._motor_row):
                if not self._torque_command and terms.by_parameter is not None:
                    self._add(terms.by_parameter, "k_pwm", i, row, self._volts * u[:, i])
        value, found = self._solve(x, terms, values, rigid, derivatives=True)
        assert found is not None and terms.by_state is not None and terms.by_parameter is not None
        by_state, by_parameter, n = terms.by_state, terms.by_parameter, layout.n_link
        a_link, M_inverse = value[:, :n], found.by_torque
        by_state[:, :n] = M_inverse @ by_state[:, :n]
        by_state[:, :n, layout.q_link] += found.by_position
        by_state[:, :n, layout.v_link] += found.by_velocity
        by_parameter[:, :n] = M_inverse @ by_parameter[:, :n]
        if self._tree.varies:
            q, v, tau = x[:, layout.q_link], x[:, layout.v_link], terms.value[:, :n]
            for name, slope in self._tree.by_parameter(q, v, tau, a_link, M_inverse, values).items():
                if name in self.names:
                    by_parameter[:, :n, self.names.index(name)] += slope
        b = self._law(values, "inertia")
        for i, row in zip(self._elastic, self._own_motor, strict=True):
            by_state[:, row] /= b[i]
            by_parameter[:, row] /= b[i]
            self._add(by_parameter, "inertia", i, row, -value[:, row] / b[i])
        return Accelerations(value, by_state, by_parameter, found)

    def _solve(
        self,
        x: Array,
        terms: TorqueTerms,
        values: Mapping[str, float],
        rigid: RigidDerivatives | None = None,
        derivatives: bool = False,
    ) -> tuple[Array, RigidDerivatives | None]:
        """Accelerations of summed torques, and the derivatives of the rigid bodies where wanted."""
        layout, n = self.layout, self.layout.n_link
        motion = x[:, layout.q_link], x[:, layout.v_link], terms.value[:, :n]
        if derivatives and rigid is None:
            a_link, *parts = self._tree.acceleration_derivatives(*motion, values)
            rigid = RigidDerivatives(*parts)
        else:
            a_link = self._tree.acceleration(*motion, values)
        value = terms.value.copy()
        value[:, :n] = a_link
        value[:, self._own_motor] /= self._law(values, "inertia")[self._elastic]
        return value, rigid

    def _terms(self, x: Array, values: Mapping[str, float], derivatives: bool) -> TorqueTerms:
        """All torques but the command's."""
        terms = TorqueTerms.zeros(len(x), self.layout, len(self.names), derivatives)
        springs = self.springs(x, values)
        self._add_springs(terms, springs)
        self._add_motors(terms, x, values)
        self._add_bearings(terms, x, values)
        self._effects.add(terms, x, springs, values)
        return terms

    def springs(self, x: Array, values: Mapping[str, float]) -> Springs:
        """Springs of all joints at states of shape (m, d)."""
        layout = self.layout
        K, D = self._law(values, "stiffness"), self._law(values, "damping")
        deflection = x[:, layout.joint_q] - x[:, layout.motor_q]
        rate = x[:, layout.joint_v] - x[:, layout.motor_v]
        slopes = [1.0 if kind == "value" else -(k**2) for k, kind in zip(K, self._stiffness_kind, strict=True)]
        stiffness_by = list(zip(self._index["stiffness"].tolist(), slopes, strict=True))
        damping_by = [(int(index), 1.0) for index in self._index["damping"]]
        return Springs(K, D, deflection, rate, K * deflection + D * rate, stiffness_by, damping_by)

    def _add_springs(self, terms: TorqueTerms, springs: Springs) -> None:
        layout, K, D = self.layout, springs.stiffness, springs.damping
        for i, motor in zip(self._elastic, self._own_motor, strict=True):
            for row, sign in ((int(layout.joint_link[i]), -1.0), (int(motor), 1.0)):
                terms.value[:, row] += sign * springs.torque[:, i]
                if terms.by_state is None or terms.by_parameter is None:
                    continue
                terms.by_state[:, row, layout.joint_q[i]] += sign * K[i]
                terms.by_state[:, row, layout.motor_q[i]] -= sign * K[i]
                terms.by_state[:, row, layout.joint_v[i]] += sign * D[i]
                terms.by_state[:, row, layout.motor_v[i]] -= sign * D[i]
                slope = springs.stiffness_by[i][1]
                self._add(terms.by_parameter, "stiffness", i, row, sign * slope * springs.deflection[:, i])
                self._add(terms.by_parameter, "damping", i, row, sign * springs.rate[:, i])

    def _add_motors(self, terms: TorqueTerms, x: Array, values: Mapping[str, float]) -> None:
        """Friction, and the back-EMF where the command is a voltage."""
        layout, mu = self.layout, self._law(values, "coulomb_torque")
        friction_v = layout.joint_v if self._friction_on_link else layout.motor_v
        smooth_sign = np.tanh(self._sharpness * x[:, friction_v])
        k_mi = np.zeros(len(mu)) if self._torque_command else self._law(values, "k_mi")
        v_motor = x[:, layout.motor_v]
        torque = -mu * smooth_sign - k_mi * v_motor
        for i, row in enumerate(self._motor_row):
            terms.value[:, row] += torque[:, i]
            if terms.by_state is None or terms.by_parameter is None:
                continue
            terms.by_state[:, row, friction_v[i]] -= mu[i] * self._sharpness * (1.0 - smooth_sign[:, i] ** 2)
            terms.by_state[:, row, layout.motor_v[i]] -= k_mi[i]
            self._add(terms.by_parameter, "coulomb_torque", i, row, -smooth_sign[:, i])
            if not self._torque_command:
                self._add(terms.by_parameter, "k_mi", i, row, -v_motor[:, i])

    def _add_bearings(self, terms: TorqueTerms, x: Array, values: Mapping[str, float]) -> None:
        layout = self.layout
        for here in self._bearings:
            for axis in "xy":
                link = layout.links.index(f"{here.owner}.bearing_{axis}")
                names = here.parameter(f"compliance_{axis}"), here.parameter(f"damping_{axis}")
                compliance, damping = values[names[0]], values[names[1]]
                q, v = x[:, link], x[:, layout.n_link + link]
                terms.value[:, link] -= q / compliance + damping * v
                if terms.by_state is None or terms.by_parameter is None:
                    continue
                terms.by_state[:, link, link] -= 1.0 / compliance
                terms.by_state[:, link, layout.n_link + link] -= damping
                for name, slope in zip(names, (q / compliance**2, -v), strict=True):
                    if name in self.names:
                        terms.by_parameter[:, link, self.names.index(name)] += slope

    def _drive(self, u: Array, values: Mapping[str, float]) -> Array:
        """Torque of the command, shape (m, n) [N m]."""
        return u if self._torque_command else self._law(values, "k_pwm") * self._volts * u

    def _find_laws(self, robot: Robot) -> None:
        """For every law and joint the parameter that holds its value."""
        laws = ("coulomb_torque", "inertia") if self._torque_command else ("coulomb_torque", "inertia", "k_pwm", "k_mi")
        self._sources = {law: [robot.drive_parameter(joint, law).name for joint in robot.joints] for law in laws}
        self._sources |= {"stiffness": [], "damping": []}
        self._stiffness_kind = []
        for joint in robot.joints:
            elasticity = f"{joint}.joint_elasticity."
            added = f"{elasticity}compliance" in robot.parameters
            base = f"{joint}.stiffness" in robot.parameters and joint in robot.layout.motors
            self._stiffness_kind.append("compliance" if added else "value" if base else "none")
            self._sources["stiffness"].append(
                f"{elasticity}compliance" if added else f"{joint}.stiffness" if base else ""
            )
            self._sources["damping"].append(f"{elasticity}damping" if added else f"{joint}.damping" if base else "")
        self._index = {
            law: np.array([self.names.index(name) if name in self.names else -1 for name in names])
            for law, names in self._sources.items()
        }

    def _law(self, values: Mapping[str, float], law: str) -> Array:
        """A law's parameter for every joint, shape (n,)."""
        found = np.array([values[name] if name else 0.0 for name in self._sources[law]])
        if law == "stiffness":
            return np.array(
                [1.0 / v if k == "compliance" else v for v, k in zip(found, self._stiffness_kind, strict=True)]
            )
        return found

    def named(self, parameters: Array) -> dict[str, float]:
        """All parameters by name: the free ones as given, the fixed ones of the robot."""
        return {**self._values, **dict(zip(self.names, parameters.tolist(), strict=True))}

    def _add(self, by_parameter: Array, law: str, joint: int, row: int, column: Array) -> None:
        index = self._index[law][joint]
        if index >= 0:
            by_parameter[:, row, index] += column


def _part(a: Accelerations, samples: slice) -> Accelerations:
    return Accelerations(a.value[samples], a.by_state[samples], a.by_parameter[samples], a.rigid)
