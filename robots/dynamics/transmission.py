# SPDX-License-Identifier: BSD-3-Clause
"""The matrix between motor and joint angles: a change of coordinates between links and springs.

    q_joint = T q_motor while no spring is stretched;  p = A q_link, A = T^-1: the links as the motors see them
    delta = p - q_motor                                the springs' deflection, in motor coordinates
    tau_link = A^T tau_p                               virtual work

Laws of springs and motors know nothing of it: they see a state whose link coordinates are p, and their torques and
derivatives are carried over. Robots whose T is the identity have no `Transmission` at all.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.effect_kinds.robot_torque import RobotTorque
from jointscope.robots.effect_kinds.transmission_elements import FROM, TransmissionElements
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


class Transmission:
    """The transmission of a robot whose motors and joints are coupled.

    Args:
        robot: its matrix, its parameters and effects.
        names: names of the free parameters.

    Attributes:
        free: index among the free parameters, row and column of each element that is one.
    """

    def __init__(self, robot: Robot, names: tuple[str, ...]):
        self._layout: StateLayout = robot.layout
        self._fixed = np.eye(robot.n) if robot.transmission is None else robot.transmission
        own, added = self._own, self._added = elements(robot)
        self._known = np.eye(robot.n), np.eye(robot.n)
        places = [(name, place) for part in (own, added) for name, place in part.items()]
        self.free = [(names.index(name), place) for name, place in places if name in names]

    @staticmethod
    def of(robot: Robot, names: tuple[str, ...] = ()) -> Transmission | None:
        """The transmission; None where every motor moves its own joint alone."""
        found = Transmission(robot, names)
        return None if robot.transmission is None and not found._own and not found._added else found

    def matrix(self, values: Mapping[str, float]) -> Array:
        """T, shape (n, n)."""
        T = self._fixed.copy()
        for name, place in self._own.items():
            T[place] = values[name]
        for name, place in self._added.items():
            T[place] += values[name]
        return T

    def inverse(self, values: Mapping[str, float]) -> Array:
        """A = T^-1, shape (n, n); laws ask several times at the same values."""
        T = self.matrix(values)
        known = self._known  # another thread may put another pair there
        if not np.array_equal(T, known[0]):
            known = self._known = (T, np.asarray(np.linalg.inv(T), dtype=np.float64))
        return known[1]

    def seen(self, x: Array, values: Mapping[str, float]) -> Array:
        """States whose link coordinates are those that the motors see, shape (m, d)."""
        layout, A = self._layout, self.inverse(values)
        y = x.copy()
        y[:, layout.joint_q] = x[:, layout.joint_q] @ A.T
        y[:, layout.joint_v] = x[:, layout.joint_v] @ A.T
        return y

    def maps(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """S and R: a law's state is S x, and R times its torques stands in the equations of motion.

        Returns:
            Shapes (d, d) and (r, r).
        """
        layout, A = self._layout, self.inverse(values)
        S, R = np.eye(layout.size), np.eye(layout.n_rates)
        S[np.ix_(layout.joint_q, layout.joint_q)] = A
        S[np.ix_(layout.joint_v, layout.joint_v)] = A
        R[np.ix_(layout.joint_link, layout.joint_link)] = A.T
        return S, R

    def carry(self, terms: TorqueTerms, x: Array, values: Mapping[str, float]) -> None:
        """Puts torques of laws that saw `seen(x)` into the equations of the links, with their derivatives.

        Args:
            terms: torques and derivatives by the state that the laws saw; changed in place.
            x: states, shape (m, d).
            values: all parameters by full name.
        """
        layout, A = self._layout, self.inverse(values)
        rows, q, v = layout.joint_link, layout.joint_q, layout.joint_v
        of_springs = terms.value[:, rows]
        terms.value[:, rows] = of_springs @ A
        if terms.by_state is None or terms.by_parameter is None:
            return
        terms.by_state[:, rows] = A.T @ terms.by_state[:, rows]
        terms.by_parameter[:, rows] = A.T @ terms.by_parameter[:, rows]
        for index, (i, j) in self.free:
            # dA = -A[:, i] A[j, :]; it moves what the laws see and where their torques go
            for columns in (q, v):
                moved = x[:, columns] @ A[j]
                terms.by_parameter[:, :, index] -= moved[:, None] * (terms.by_state[:, :, columns] @ A[:, i])
            terms.by_parameter[:, rows, index] -= (of_springs @ A[:, i])[:, None] * A[j]
        for columns in (q, v):
            terms.by_state[:, :, columns] = terms.by_state[:, :, columns] @ A


def parted(robot: Robot, transmission: Transmission | None) -> tuple[list[EffectAt], list[EffectAt]]:
    """Effects that see the links through the transmission, and those of links and rigid joints."""
    behind = [] if transmission is None else [here for here in robot.effects if is_behind(here, robot)]
    return behind, [here for here in robot.effects if here not in behind]


def is_behind(here: EffectAt, robot: Robot) -> bool:
    """Whether an effect acts between the transmission and a motor."""
    if isinstance(here.effect, JointTorque):
        own = here.effect.side != "link" and here.effect.load != "weight"
        return own and here.owner in robot.layout.motors
    return isinstance(here.effect, RobotTorque)


def elements(robot: Robot) -> tuple[dict[str, tuple[int, int]], dict[str, tuple[int, int]]]:
    """Parameters that are elements of T, and those of effects that add to elements, with row and column."""
    place = {joint: i for i, joint in enumerate(robot.joints)}
    own = {
        f"{a}.{FROM}{b}": (i, j)
        for a, i in place.items()
        for b, j in place.items()
        if f"{a}.{FROM}{b}" in robot.parameters
    }
    added = {
        here.parameter(p.name): (place[here.owner], place[p.name.removeprefix(FROM)])
        for here in robot.effects
        if isinstance(here.effect, TransmissionElements)
        for p in here.effect.parameters_at(robot, here.owner)
    }
    return own, added


def joint_angles(robot: Robot, q_motor: Array) -> Array:
    """Where the joints are while no spring is stretched, shape (..., n)."""
    found = Transmission.of(robot)
    if found is None:
        return q_motor
    return q_motor @ found.matrix(robot.values).T


def motor_angles(robot: Robot, q_link: Array) -> Array:
    """Where the motors are while no spring is stretched, shape (..., n)."""
    found = Transmission.of(robot)
    if found is None:
        return q_link
    return q_link @ found.inverse(robot.values).T
