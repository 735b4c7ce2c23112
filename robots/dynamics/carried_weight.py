# SPDX-License-Identifier: BSD-3-Clause
"""What gears carry at rest: the weight of everything behind them, and known loads that hang on it.

A rigid joint has no spring whose torque could be read off the state. The torque through its gear would have to be
solved for, together with the friction that depends on it; its part that does not depend on accelerations,

    tau_c = T^T (J^T F - g(q)),   M(q) a + c(q, v) + g(q) + tau_c = J^T F at rest,

stands for the whole, with the matrix T of a coupled transmission. Behind a spring it is the load by the definition of
Ho and Kisner (BioRob), eq. (14); the torque of the spring is the other one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import Transmission
from jointscope.robots.effect_kinds.joint_torque import JointTorque, signals_used
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import StructuredTree

Array = NDArray[np.float64]


class CarriedWeight:
    """Torques of gravity and known loads through gears.

    Args:
        robot: the robot.
        names: names of the free parameters.

    Attributes:
        some: whether gravity acts at all.
    """

    def __init__(self, robot: Robot, names: tuple[str, ...] = ()):
        self._layout, self._tree, self._names = robot.layout, StructuredTree(robot), names
        self._transmission = Transmission.of(robot, names)
        self._n = robot.n
        self.some = bool(np.any(self._tree.kinematics.gravity))

    def on(self, joint: str, effect: JointTorque, p: Mapping[str, Any]) -> CarriedWeight | None:
        """This, if it is the load that an effect asks for.

        Args:
            joint: owner of the effect.
            effect: its law, which may have no use for a load; then none is computed.
            p: some values of its parameters.
        """
        carried = joint not in self._layout.motors or effect.load == "weight"
        return self if self.some and carried and _asks_for_load(effect, p) else None

    def torque(self, x: Array, values: Mapping[str, float], outside: Array | None = None) -> Array:
        """tau_c of every joint at states of shape (m, d); shape (m, n) [N m].

        Args:
            x: states.
            values: all parameters by full name.
            outside: torques J^T F of known loads about the joints, shape (m, n) [N m].
        """
        return self._on_joints(x, values, outside) @ self._matrix(values)

    def slopes(self, x: Array, values: Mapping[str, float]) -> Array:
        """Derivative of `torque` by the positions of the links, shape (m, n, n_link) [N m/rad]."""
        if not self.some:
            return np.zeros((len(x), self._n, self._layout.n_link))
        by_q = -self._tree.bodies(values).gravity_derivatives(x[:, self._layout.q_link])[:, self._layout.joint_link]
        return np.asarray(self._matrix(values).T @ by_q)

    def by_parameter(self, x: Array, values: Mapping[str, float], outside: Array | None = None) -> dict[int, Array]:
        """Derivative of `torque` by each free parameter that changes it, by index, shape (m, n)."""
        found: dict[int, Array] = {}
        if self._transmission is not None and self._transmission.free:
            on_joints = self._on_joints(x, values, outside)
            for index, (joint, motor) in self._transmission.free:
                found[index] = np.zeros_like(on_joints)
                found[index][:, motor] = on_joints[:, joint]
        if self.some:
            rows, T = self._layout.joint_link, self._matrix(values)
            for name, weight in self._tree.gravity_by_parameter(x[:, self._layout.q_link], values).items():
                if name in self._names:
                    found[self._names.index(name)] = -weight[:, rows] @ T
        return found

    def _on_joints(self, x: Array, values: Mapping[str, float], outside: Array | None) -> Array:
        """J^T F - g about the joints, shape (m, n) [N m]."""
        found = np.zeros((len(x), self._n)) if outside is None else outside
        if not self.some:
            return found
        q = x[:, self._layout.q_link]
        still = np.zeros_like(q)
        return found - self._tree.bodies(values).torque(q, still, still)[:, self._layout.joint_link]

    def _matrix(self, values: Mapping[str, float]) -> Array:
        """T, shape (n, n)."""
        return np.eye(self._n) if self._transmission is None else self._transmission.matrix(values)


def _asks_for_load(effect: JointTorque, p: Mapping[str, Any]) -> bool:
    """Whether a law, or the rate of its memory, uses the torque through the gear."""
    laws = [effect.law] if effect.memory is None else [effect.law, effect.memory.rate]
    return any("tau_spring" in signals_used(law, p) for law in laws)
