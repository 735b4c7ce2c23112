# SPDX-License-Identifier: BSD-3-Clause
"""Accelerations of a robot with elastic joints, with all derivatives, for many samples at once.

    link side   M(q) a + c(q, v) + g(q) + tau_c = tau_link effects                      (eq. 1, 5)
    motor side  b a_motor = tau_c + tau_motor(u, v_motor) - tau_friction + effects      (eq. 2, 7)
    coupling    tau_c = K (q_link - q_motor) + D (v_link - v_motor) + effects           (eq. 6)
                where motors and joints are coupled: with A q_link for q_link, and A^T tau_c on the links
    motor       tau_motor = k_pwm U u - k_mi v_motor                                    (eq. 11)
    friction    tau_friction = mu tanh(k v)                                             (eq. 12)
    bearing     tau = -q / compliance - damping v   on each hinge of a soft bearing

A rigid joint has no motor side: its motor torque and inertia act on the link. Equation numbers: Schuethe, Wenk,
Frese (2016).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.accelerations import Accelerations, RigidDerivatives
from jointscope.robots.dynamics.bearing_springs import BearingSprings
from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.dynamics.effect_torques import EffectTorques
from jointscope.robots.dynamics.joint_springs import JointSprings, Springs
from jointscope.robots.dynamics.motor_torques import MotorTorques
from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.dynamics.transmission import Transmission, parted
from jointscope.robots.model.encoder_plays import EncoderPlays
from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.model.lasting_torques import LastingTorques
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import StructuredTree

Array = NDArray[np.float64]


class ElasticJoints:
    """The equations of motion of one robot.

    Args:
        robot: tree, drives, effects and parameters.

    Attributes:
        names: names of the free parameters, in the order of every parameter vector here.
        layout: of the state.
        plays: of its encoders, whose lags follow positions from tick to tick; None where there are none.
    """

    def __init__(self, robot: Robot):
        robot.need_link_dynamics()
        self.layout = layout = robot.layout
        self._tree, self.plays = StructuredTree(robot), EncoderPlays.of(robot)
        self._parameters = parameters = JointParameters(robot)
        self.names = parameters.names
        self._motors, self._springs = MotorTorques(robot, parameters), JointSprings(layout, parameters)
        self._bearings = BearingSprings(robot.effects, layout, self.names)
        self._lasting = LastingTorques(robot, parameters)
        self._transmission = Transmission.of(robot, self.names)
        weight = CarriedWeight(robot, self.names)
        self._friction_sharpness = robot.friction_sharpness
        self._behind, self._effects = (
            EffectTorques(some, robot.joints, layout, self.names, robot.friction_sharpness, weight)
            for some in parted(robot, self._transmission)
        )
        self._elastic = list(layout.elastic_joints)
        self._own_motor = layout.motor_row[self._elastic].tolist()

    @property
    def tree(self) -> StructuredTree:
        """The rigid bodies."""
        return self._tree

    def accelerations(self, x: Array, u: Array, parameters: Array, sliding: Array | None = None) -> Array:
        """Link and motor accelerations, and rates of memories.

        Args:
            x: states, shape (m, d).
            u: commands in their SI unit, shape (m, n).
            parameters: values of the free parameters, shape (p,).
            sliding: how sharply the dry friction of each joint turns over, as a part of what its law says, (m, n).

        Returns:
            Shape (m, r) [rad/s^2].
        """
        values = self.named(parameters)
        terms = self._terms(x, values, derivatives=False, sharpness=self._sharp(values, sliding))
        terms.value[:, self.layout.motor_row] += self._motors.of_command(u, values)
        return self._solve(x, terms, values)[0]

    def with_derivatives(
        self,
        x: Array,
        u: Array,
        parameters: Array,
        rigid: RigidDerivatives | None = None,
        sliding: Array | None = None,
    ) -> Accelerations:
        """Accelerations with derivatives; arguments as in `accelerations` and `without_command`."""
        if self._commands_move_links:
            return self._differentiate(x, parameters, rigid, u, sliding)
        return self.with_command(self.without_command(x, parameters, rigid, sliding), u, parameters)

    def at_ticks(
        self, x: Array, u: tuple[Array, Array], parameters: Array, sliding: Array | None = None
    ) -> tuple[Accelerations, Accelerations, RigidDerivatives | None]:
        """Accelerations at the beginning and the end of m steps, with the command of each step there.

        Args:
            x: states at the m + 1 ticks, shape (m + 1, d).
            u: commands where the m steps begin and where they end, shape (m, n) each.
            parameters: values of the free parameters, shape (p,).
            sliding: as in `accelerations`, at the ticks.

        Returns:
            Both, and the rigid bodies' derivatives between the ticks where they are cheap to know.
        """
        if self._commands_move_links:
            begins, ends = (None, None) if sliding is None else (sliding[:-1], sliding[1:])
            first = self._differentiate(x[:-1], parameters, None, u[0], begins)
            last = self._differentiate(x[1:], parameters, None, u[1], ends)
            return first, last, None
        free = self.without_command(x, parameters, sliding=sliding)
        parts = free.part(slice(None, -1)), free.part(slice(1, None))
        first, last = (self.with_command(part, own, parameters) for part, own in zip(parts, u, strict=True))
        return first, last, free.rigid.between()

    def without_command(
        self, x: Array, parameters: Array, rigid: RigidDerivatives | None = None, sliding: Array | None = None
    ) -> Accelerations:
        """As `with_derivatives` at u = 0; the dear part, which consecutive steps share.

        Args:
            x: states, shape (m, d).
            parameters: values of the free parameters, shape (p,).
            rigid: derivatives of the rigid bodies where they are known well enough; the accelerations themselves are
                always exact.
            sliding: as in `accelerations`.
        """
        return self._differentiate(x, parameters, rigid, None, sliding)

    def with_command(self, free: Accelerations, u: Array, parameters: Array) -> Accelerations:
        """Adds the command to the result of `without_command`; for robots without rigid joints.

        Args:
            free: accelerations at u = 0; not changed.
            u: commands in their SI unit, shape (m, n).
            parameters: values of the free parameters, shape (p,).
        """
        values = self.named(parameters)
        b, rows, torque = self.motor_inertia(values), self.layout.motor_row, self._motors.of_command(u, values)
        value, by_parameter = free.value.copy(), free.by_parameter.copy()
        value[:, rows] += torque / b
        for i, row in enumerate(rows.tolist()):
            self._parameters.add(by_parameter, "inertia", i, row, -torque[:, i] / b[i] ** 2)
        self._motors.add_command_slopes(by_parameter, u, b)
        return Accelerations(value, free.by_state, by_parameter, free.rigid)

    def drive_gain(self, parameters: Array) -> Array:
        """Torque of each motor per unit of its command, shape (n,) [N m / unit]."""
        return self._motors.of_command(np.ones((1, len(self.layout.joints))), self.named(parameters))[0]

    def torques(
        self, x: Array, u: Array, parameters: Array, outside: Array | None = None, sharpness: Array | None = None
    ) -> TorqueTerms:
        """Torques of everything but the rigid bodies, with derivatives; a command moves no column.

        Args:
            x: states, shape (m, d).
            u: commands in their SI unit, shape (m, n).
            parameters: values of the free parameters, shape (p,).
            outside: torques of known loads about the joints, for what depends on them, shape (m, n) [N m].
            sharpness: of the friction, where it is another one than the robot's, shape (n,) [s/rad].
        """
        values = self.named(parameters)
        terms = self._terms(x, values, derivatives=True, outside=outside, sharpness=sharpness)
        assert terms.by_parameter is not None
        terms.value[:, self.layout.motor_row] += self._motors.of_command(u, values)
        self._motors.add_command_slopes(terms.by_parameter, u)
        return terms

    def motor_inertia(self, values: Mapping[str, float]) -> Array:
        """Inertia of each motor, shape (n,) [kg m2]."""
        return self._parameters.of(values, "inertia")

    def springs(self, x: Array, values: Mapping[str, float]) -> Springs:
        """Springs of all joints at states of shape (m, d)."""
        return self._springs.at(self.seen(x, values), values)

    def seen(self, x: Array, values: Mapping[str, float]) -> Array:
        """States as springs and motors see them, through the transmission, shape (m, d)."""
        return x if self._transmission is None else self._transmission.seen(x, values)

    def named(self, parameters: Array) -> dict[str, float]:
        """All parameters by name: the free ones as given, shape (p,), the fixed ones of the robot."""
        return self._parameters.named(parameters)

    def command_response(self, accelerations: Accelerations, parameters: Array) -> Array:
        """Derivative of the accelerations by the command of each joint, shape (m, r, n)."""
        layout, gain = self.layout, self.drive_gain(parameters)
        response = np.zeros((len(accelerations.value), layout.n_rates, len(gain)))
        b = self.motor_inertia(self.named(parameters))
        for i, row in enumerate(layout.motor_row.tolist()):
            if row >= layout.n_link:
                response[:, row, i] = gain[i] / b[i]
            else:
                response[:, : layout.n_link, i] = accelerations.rigid.by_torque[:, :, row] * gain[i]
        return response

    @property
    def _commands_move_links(self) -> bool:
        """Whether a command accelerates a link at once, as the motor of a rigid joint does."""
        return len(self._elastic) < len(self.layout.joints)

    def _differentiate(
        self, x: Array, parameters: Array, rigid: RigidDerivatives | None, u: Array | None, sliding: Array | None
    ) -> Accelerations:
        from jointscope.robots.dynamics.follow_kernel import links_follow  # numba takes half a second to import

        layout, values = self.layout, self.named(parameters)
        terms = self._terms(x, values, derivatives=True, sharpness=self._sharp(values, sliding))
        assert terms.by_state is not None and terms.by_parameter is not None
        if u is not None:
            terms.value[:, layout.motor_row] += self._motors.of_command(u, values)
            self._motors.add_command_slopes(terms.by_parameter, u)
        value, found = self._solve(x, terms, values, rigid, derivatives=True)
        assert found is not None
        by_state, by_parameter, n = terms.by_state, terms.by_parameter, layout.n_link
        a_link, M_inverse = value[:, :n], found.by_torque
        parts = (np.ascontiguousarray(part) for part in (M_inverse, found.by_position, found.by_velocity))
        links_follow(*parts, by_state, by_parameter)
        if self._tree.varies:
            q, v, tau = x[:, layout.q_link], x[:, layout.v_link], terms.value[:, :n]
            for name, slope in self._tree.by_parameter(q, v, tau, a_link, M_inverse, values).items():
                if name in self.names:
                    by_parameter[:, :n, self.names.index(name)] += slope
        b = self.motor_inertia(values)
        for i, row in zip(self._elastic, self._own_motor, strict=True):
            by_state[:, row] /= b[i]
            by_parameter[:, row] /= b[i]
            self._parameters.add(by_parameter, "inertia", i, row, -value[:, row] / b[i])
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
        value[:, self._own_motor] /= self.motor_inertia(values)[self._elastic]
        return value, rigid

    def _sharp(self, values: Mapping[str, float], sliding: Array | None) -> Array | None:
        """Sharpness of the friction; None where it is that of the law everywhere."""
        return None if sliding is None else sliding * self._friction_sharpness(values)

    def _terms(
        self,
        x: Array,
        values: Mapping[str, float],
        derivatives: bool,
        outside: Array | None = None,
        sharpness: Array | None = None,
    ) -> TorqueTerms:
        """All torques but the command's."""
        terms = TorqueTerms.zeros(len(x), self.layout, len(self.names), derivatives)
        y = self.seen(x, values)
        springs = self._springs.at(y, values)
        self._springs.add(terms, springs)
        if self._transmission is not None:
            self._behind.add(terms, y, springs, values, outside, sharpness)
            self._transmission.carry(terms, x, values)
        self._motors.add(terms, x, values, sharpness)
        self._bearings.add(terms, x, values)
        self._lasting.add(x, values, terms.value, terms.by_state, terms.by_parameter)
        self._effects.add(terms, x, springs, values, outside, sharpness)
        return terms
