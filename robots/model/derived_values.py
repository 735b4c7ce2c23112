# SPDX-License-Identifier: BSD-3-Clause
"""Values of a robot's derived results, with their derivatives by its parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import StructuredTree
from jointscope.robots.parts.derived import Derived


def derived_value(robot: Robot, result: Derived, values: Mapping[str, float]) -> tuple[float, dict[str, float]]:
    """A derived result and its derivative by each parameter that it follows from.

    Args:
        robot: the robot.
        result: one of its derived results.
        values: all parameters by full name.
    """
    if result.of:
        return sum(factor * values[name] for name, factor in result.of.items()), dict(result.of)
    tree, layout = StructuredTree(robot), robot.layout
    q = np.zeros((1, layout.n_link))
    q[0, layout.joint_link] = result.at
    factors = np.zeros(layout.n_link)
    for joint, factor in result.gravity.items():
        factors[layout.joint_link[robot.joints.index(joint)]] = factor
    still = np.zeros_like(q)
    value = float(tree.bodies(values).torque(q, still, still)[0] @ factors)
    return value, {name: float(by[0] @ factors) for name, by in tree.gravity_by_parameter(q, values).items()}
