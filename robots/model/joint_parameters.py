# SPDX-License-Identifier: BSD-3-Clause
"""Which parameter of a robot holds the value of each law at each joint, and where its derivatives go."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import SHARPNESS, Robot

Array = NDArray[np.float64]


class JointParameters:
    """Parameters of the base model's laws, joint by joint.

    Laws are "inertia", "coulomb_torque", "stiffness", "damping" and, where the command is a voltage, "k_pwm" and
    "k_mi", where it is a current, "torque_constant". A spring that an effect gave to a rigid joint has a compliance,
    that of the base model a stiffness.

    Args:
        robot: drives, springs and parameters.

    Attributes:
        names: names of the free parameters, in the order of every parameter vector.
    """

    def __init__(self, robot: Robot):
        self.names = tuple(name for name, parameter in robot.parameters.items() if not parameter.fixed)
        self._values = robot.values
        drives = ("coulomb_torque", "inertia", *robot.drive_laws)
        self._sources = {law: [robot.drive_parameter(joint, law).name for joint in robot.joints] for law in drives}
        own = [f"{joint}.{SHARPNESS}" for joint in robot.joints]
        self._sources[SHARPNESS] = [name if name in robot.parameters else "" for name in own]
        springs = [_spring_of(robot, joint) for joint in robot.joints]
        self._sources["stiffness"] = [stiffness for stiffness, _ in springs]
        self._sources["damping"] = [damping for _, damping in springs]
        # joints whose stiffness is the inverse of a parameter
        self._compliant = [i for i, (name, _) in enumerate(springs) if name.endswith(".compliance")]
        self._index = {law: [self._place(name) for name in names] for law, names in self._sources.items()}

    def named(self, parameters: Array) -> dict[str, float]:
        """All parameters by name: the free ones as given, shape (p,), the fixed ones of the robot."""
        return {**self._values, **dict(zip(self.names, parameters.tolist(), strict=True))}

    def of(self, values: Mapping[str, float], law: str) -> Array:
        """A law's value for every joint, shape (n,); zero for the spring of a rigid joint."""
        found = np.array([values[name] if name else 0.0 for name in self._sources[law]])
        if law == "stiffness":
            found[self._compliant] = 1.0 / found[self._compliant]
        return found

    def source(self, law: str, joint: int) -> str:
        """Full name of the parameter that holds a law's value at a joint; empty for the spring of a rigid joint."""
        return self._sources[law][joint]

    def slopes(self, law: str, found: Array) -> list[tuple[int, float]]:
        """For each joint the index among the free parameters, -1 for none, and the derivative of the law by it.

        Args:
            law: name of the law.
            found: its values, shape (n,).
        """
        slopes = np.ones(len(found))
        if law == "stiffness":
            slopes[self._compliant] = -(found[self._compliant] ** 2)
        return list(zip(self._index[law], slopes.tolist(), strict=True))

    def add(self, by_parameter: Array, law: str, joint: int, row: int, column: Array) -> None:
        """Adds a derivative by a law's parameter, where that is free.

        Args:
            by_parameter: receives it, shape (m, r, p).
            law: name of the law.
            joint: index of the joint.
            row: equation.
            column: derivative, shape (m,).
        """
        index = self._index[law][joint]
        if index >= 0:
            by_parameter[:, row, index] += column

    def _place(self, name: str) -> int:
        return self.names.index(name) if name in self.names else -1


def _spring_of(robot: Robot, joint: str) -> tuple[str, str]:
    """Names of the parameters of a joint's spring and damper; empty for a rigid joint."""
    added = f"{joint}.joint_elasticity.compliance"
    if added in robot.parameters:
        return added, f"{joint}.joint_elasticity.damping"
    if joint in robot.layout.motors and f"{joint}.stiffness" in robot.parameters:
        return f"{joint}.stiffness", f"{joint}.damping"
    return "", ""
