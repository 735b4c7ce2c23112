# SPDX-License-Identifier: BSD-3-Clause
"""What the gear of a rigid joint passes on at rest: the weight of everything behind it.

A rigid joint has no spring whose torque could be read off the state. The torque through its gear would have to be
solved for, together with the friction that depends on it; its part that does not depend on accelerations,

    tau_c = -g(q),   M(q) a + c(q, v) + g(q) + tau_c = 0 at rest,

stands for the whole. Masses are those of the URDF.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.joint_torque import JointTorque, signals_used
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


class CarriedWeight:
    """Torques of gravity through rigid joints.

    Args:
        robot: the robot.
    """

    def __init__(self, robot: Robot):
        self._layout, self._tree = robot.layout, robot.kinematic_tree
        self._joints = [i for i, joint in enumerate(robot.joints) if joint not in robot.layout.motors]
        self._rows = [int(robot.layout.joint_link[i]) for i in self._joints]
        self._count = len(robot.joints)

    @property
    def some(self) -> bool:
        """Whether any rigid joint carries a weight."""
        return bool(self._joints) and bool(np.any(self._tree.gravity))

    def on(self, joint: str, effect: JointTorque, p: Mapping[str, Any]) -> CarriedWeight | None:
        """This, if it is the load that an effect asks for: its joint is rigid and carries a weight.

        Args:
            joint: owner of the effect.
            effect: its law, which may have no use for a load; then none is computed.
            p: some values of its parameters.
        """
        return self if self.some and joint not in self._layout.motors and _asks_for_load(effect, p) else None

    def torque(self, x: Array) -> Array:
        """tau_c of every joint, zero for elastic ones, at states of shape (m, d); shape (m, n) [N m]."""
        found = np.zeros((len(x), self._count))
        if self.some:
            q = x[:, self._layout.q_link]
            found[:, self._joints] = -self._tree.torque(q, np.zeros_like(q), np.zeros_like(q))[:, self._rows]
        return found

    def slopes(self, x: Array) -> Array:
        """Derivative of `torque` by the positions of the links, shape (m, n, n_link) [N m/rad]."""
        found = np.zeros((len(x), self._count, self._layout.n_link))
        if self.some:
            by_q = self._tree.gravity_derivatives(x[:, self._layout.q_link])
            found[:, self._joints] = -by_q[:, self._rows]
        return found


def _asks_for_load(effect: JointTorque, p: Mapping[str, Any]) -> bool:
    """Whether a law, or the rate of its memory, uses the torque through the gear."""
    laws = [effect.law] if effect.memory is None else [effect.law, effect.memory.rate]
    return any("tau_spring" in signals_used(law, p) for law in laws)
