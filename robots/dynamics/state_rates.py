# SPDX-License-Identifier: BSD-3-Clause
"""dx/dt of one state with its Jacobian: the equations of `ElasticJoints`, as fast as a control loop needs them.

Parameters are fixed when it is built, so everything linear is one matrix; laws of effects are evaluated once for their
value and all their slopes, by complex steps side by side. A test holds it against `ElasticJoints`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.bearing_springs import BearingSprings
from jointscope.robots.dynamics.joint_springs import JointSprings, Springs
from jointscope.robots.dynamics.law_at_one_state import (
    CoupledLawAtOneState,
    LawAtOneState,
    LawsBehindTransmission,
    side_by_side,
)
from jointscope.robots.dynamics.motor_torques import MotorTorques
from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.dynamics.transmission import Transmission, parted
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.effect_kinds.robot_torque import RobotTorque
from jointscope.robots.model.encoder_plays import EncoderPlays
from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.model.lasting_torques import LastingTorques
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import StructuredTree

Array = NDArray[np.float64]


class StateRates:
    """The motion of one robot with its present parameters.

    Args:
        robot: tree, drives, effects and parameters.
        values: other values than the robot's own, by full name.

    Attributes:
        layout: of the state.
        friction_columns: columns of the velocities that the friction of each joint depends on, shape (n,).
        sharpness: k of the friction law of each joint, shape (n,) [s/rad].
        has_kinks: whether a law of an effect may bend sharply within a step.
        plays: of its encoders, whose lags follow positions from tick to tick; None where there are none.
        play_sizes: half of each of them, shape (k,) [rad].
    """

    def __init__(self, robot: Robot, values: Mapping[str, float] | None = None):
        self.layout = layout = robot.layout
        named = robot.values | dict(values or {})
        self.plays = EncoderPlays.of(robot)
        self.play_sizes = np.zeros(0) if self.plays is None else self.plays.sizes(named)
        parameters, tree = JointParameters(robot), StructuredTree(robot)
        motors = MotorTorques(robot, parameters)
        bodies = tree.bodies(named)
        self._equations = bodies.equations
        # share of the Coriolis terms that the model has; accelerations are linear in it, beyond 0 and 1, too
        self._scale = named[tree.coriolis_scale] if tree.coriolis_scale else float(bodies.coriolis)
        springs = JointSprings(layout, parameters)
        self._linear = linear_torques(robot, parameters, springs, motors, named)
        self._torque_of_command = motors.of_command(np.ones((1, robot.n)), named)[0]
        self._coulomb = parameters.of(named, "coulomb_torque")
        self.sharpness = robot.friction_sharpness(named)
        self._sharpest = self.sharpness.copy()
        self.friction_columns = layout.velocities_at(robot.choices.friction_velocity)
        self._rows = layout.motor_row
        n = layout.n_link
        # a slice where all motors have equations of their own: quicker
        own_rows = np.array_equal(self._rows, np.arange(n, n + robot.n))
        self._added = slice(n, n + robot.n) if own_rows else self._rows
        own = [layout.joints.index(joint) for joint in layout.motors]
        self._inertia = parameters.of(named, "inertia")[own]
        at_zero = springs.at(np.zeros((1, layout.size)), named)
        straight, bent = _laws(robot, at_zero, named, self.sharpness)
        self._constant, self._laws = np.zeros(layout.n_rates), bent
        for law in straight:
            law.add(np.zeros(layout.size), self._constant, self._linear)
        bends = [here.effect.bends for here in robot.effects if isinstance(here.effect, JointTorque)]
        self.has_kinks = "sharply" in bends or any(isinstance(here.effect, RobotTorque) for here in robot.effects)
        self._kinematic = np.zeros((layout.size, layout.size))
        self._kinematic[layout.positions, layout.velocities] = 1.0
        n, m = layout.n_link, layout.n_motor
        self._n, self._motor_rows, self._memory_rows = n, slice(n, n + m), slice(n + m, layout.n_rates)
        self._no_velocity, self._weights = np.zeros(n), (1.0 / self._inertia)[:, None]
        self._by_torque = np.zeros((layout.size, robot.n))
        self._on_links = [(j, row) for j, row in enumerate(self._rows.tolist()) if row < n]
        for j, row in enumerate(self._rows.tolist()):
            if row >= n:
                self._by_torque[layout.v_motor.start + row - n, j] = 1.0 / self._inertia[row - n]

    def know_velocities(self, sigma: Array) -> None:
        """Dry friction becomes its mean over what the velocities may be (statistical linearisation).

        A velocity that is known to less than the width 1/k of the turn rubs one way or the other: with v normal,

            E tanh(k v) = tanh(k v / sqrt(1 + pi/2 (k sigma)^2))   within 0.04,

        and the slope of that is what the uncertainty sees of the friction, not the slope at the mean.

        Args:
            sigma: of the velocities that friction acts against, shape (n,) [rad/s].
        """
        self.sharpness[:] = self._sharpest / np.sqrt(1.0 + 0.5 * np.pi * (self._sharpest * sigma) ** 2)

    def command_torque(self, u: Array) -> Array:
        """Torque of the motors for a command in its SI unit, shape (n,) [N m]."""
        return self._torque_of_command * u

    def rates(self, x: Array, command_torque: Array) -> Array:
        """dx/dt.

        Args:
            x: state, shape (d,).
            command_torque: of the motors, shape (n,) [N m].

        Returns:
            Shape (d,).
        """
        tau = self._constant + self._linear @ x
        tau[self._added] += command_torque - self._coulomb * np.tanh(self.sharpness * x[self.friction_columns])
        for law in self._laws:
            law.add(x, tau, None)
        layout = self.layout
        q, v, torque = x[layout.q_link], x[layout.v_link], tau[: self._n]
        s, acceleration = self._scale, self._equations.acceleration_at
        a = acceleration(q, v if s != 0.0 else self._no_velocity, torque)
        if s not in (0.0, 1.0):
            still = acceleration(q, self._no_velocity, torque)
            a = still + s * (a - still)
        return self._rate(x, tau, a)

    def with_jacobian(self, x: Array, command_torque: Array) -> tuple[Array, Array, Array]:
        """dx/dt, its derivative by the state, and by the torque of each motor.

        Args:
            x: state, shape (d,).
            command_torque: of the motors, shape (n,) [N m].

        Returns:
            Shapes (d,), (d, d) and (d, n).
        """
        layout, n = self.layout, self._n
        tau, by_state = self._constant + self._linear @ x, self._linear.copy()
        smooth_sign = np.tanh(self.sharpness * x[self.friction_columns])
        tau[self._added] += command_torque - self._coulomb * smooth_sign
        by_state[self._rows, self.friction_columns] -= self._coulomb * self.sharpness * (1.0 - smooth_sign**2)
        for law in self._laws:
            law.add(x, tau, by_state)
        a, by_q, by_v, M_inverse = self._rigid(x[layout.q_link], x[layout.v_link], tau[:n])
        A = self._kinematic.copy()
        A[layout.v_link] = M_inverse @ by_state[:n]
        A[layout.v_link, layout.q_link] += by_q
        A[layout.v_link, layout.v_link] += by_v
        A[layout.v_motor] = by_state[self._motor_rows] * self._weights
        A[layout.memory] = by_state[self._memory_rows]
        by_torque = self._by_torque
        if self._on_links:
            by_torque = by_torque.copy()
            for j, row in self._on_links:
                by_torque[layout.v_link, j] = M_inverse[:, row]
        return self._rate(x, tau, a), A, by_torque

    def _rigid(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array, Array, Array]:
        """Accelerations of the links and their derivatives by q, v and tau."""
        s, derivatives = self._scale, self._equations.derivatives_at
        if s == 0.0:
            a, by_q, by_v, M_inverse = derivatives(q, self._no_velocity, tau)
            return a, by_q, np.zeros_like(by_v), M_inverse
        moving = derivatives(q, v, tau)
        if s == 1.0:
            return moving
        still = derivatives(q, self._no_velocity, tau)
        a, by_q = (still[i] + s * (moving[i] - still[i]) for i in (0, 1))
        return a, by_q, s * moving[2], moving[3]

    def _rate(self, x: Array, tau: Array, a_link: Array) -> Array:
        layout, rate = self.layout, np.empty_like(x)
        rate[layout.q_link], rate[layout.q_motor] = x[layout.v_link], x[layout.v_motor]
        rate[layout.v_link] = a_link
        rate[layout.v_motor] = tau[self._motor_rows] / self._inertia
        rate[layout.memory] = tau[self._memory_rows]
        return rate


def linear_torques(
    robot: Robot, parameters: JointParameters, springs: JointSprings, motors: MotorTorques, values: Mapping[str, float]
) -> Array:
    """Torques per state of springs, dampers, bearings and back-EMF, shape (r, d)."""
    x = np.zeros((1, robot.layout.size))
    without_friction = {name: 0.0 if name.endswith(".coulomb_torque") else value for name, value in values.items()}
    terms = TorqueTerms.zeros(1, robot.layout, len(parameters.names), derivatives=True)
    springs.add(terms, springs.at(x, values))
    transmission = Transmission.of(robot)
    if transmission is not None:
        transmission.carry(terms, x, values)
    motors.add(terms, x, without_friction)
    BearingSprings(robot.effects, robot.layout, parameters.names).add(terms, x, values)
    LastingTorques(robot, parameters).add(x, values, terms.value, terms.by_state, terms.by_parameter)
    assert terms.by_state is not None
    return terms.by_state[0]


def _laws(
    robot: Robot, springs: Springs, values: Mapping[str, float], sharpness: Array
) -> tuple[list[LawAtOneState], list[LawAtOneState]]:
    """Torque laws among the robot's effects: those that are linear in the state, and the others."""
    transmission = Transmission.of(robot)
    maps = None if transmission is None else transmission.maps(values)
    found: tuple[list[LawAtOneState], list[LawAtOneState]] = [], []
    for part, is_inside in zip(parted(robot, transmission), (True, False), strict=True):
        joint = [here for here in part if isinstance(here.effect, JointTorque)]
        straight = [here for here in joint if isinstance(here.effect, JointTorque) and here.effect.bends == "never"]
        bent = [here for here in joint if here not in straight]
        both = [side_by_side(own, robot, springs, values, sharpness) for own in (straight, bent)]
        both[1] += [
            CoupledLawAtOneState(here, robot, springs, values, sharpness)
            for here in part
            if isinstance(here.effect, RobotTorque)
        ]
        for laws, own in zip(found, both, strict=True):
            laws += [LawsBehindTransmission(own, *maps)] if own and is_inside and maps is not None else own
    return found
