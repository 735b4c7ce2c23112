# SPDX-License-Identifier: BSD-3-Clause
"""Torques that the springs pass on to the links, with the effects that act in them: what a torque sensor feels.

tau = -tau_c = K (q_motor - q_link) + D (v_motor - v_link) + effects
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.dynamics.effect_torques import EffectTorques
from jointscope.robots.dynamics.joint_springs import JointSprings
from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.effect_kinds.joint_torque import is_spring_law
from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


Reading = Callable[[Array], tuple[Array, Array]]


class SpringTorques:
    """The springs of one robot, all of whose joints have one.

    Args:
        robot: springs, effects and parameters.

    Attributes:
        names: of the free parameters, shape (p,).
    """

    def __init__(self, robot: Robot):
        self._layout, parameters = robot.layout, JointParameters(robot)
        self.names = parameters.names
        self._parameters, self._springs = parameters, JointSprings(robot.layout, parameters)
        inside = [h for h in robot.effects if is_spring_law(h.effect)]
        self._effects = EffectTorques(
            inside, robot.joints, robot.layout, self.names, robot.friction_sharpness, CarriedWeight(robot)
        )

    def named(self, parameters: Array) -> dict[str, float]:
        """All parameters by name: the free ones as given, shape (p,), the fixed ones of the robot."""
        return self._parameters.named(parameters)

    def value(self, x: Array, values: Mapping[str, float]) -> Array:
        """Torques at states of shape (m, d), shape (m, n) [N m]."""
        return self._terms(x, values, False).value[:, self._layout.joint_link]

    def with_derivatives(self, x: Array, values: Mapping[str, float]) -> tuple[Array, Array, Array]:
        """Torques, shape (m, n), and their derivatives by states, (m, n, d), and free parameters, (m, n, p)."""
        terms, rows = self._terms(x, values, True), self._layout.joint_link
        assert terms.by_state is not None and terms.by_parameter is not None
        return terms.value[:, rows], terms.by_state[:, rows], terms.by_parameter[:, rows]

    def _terms(self, x: Array, values: Mapping[str, float], derivatives: bool) -> TorqueTerms:
        terms = TorqueTerms.zeros(len(x), self._layout, len(self.names), derivatives)
        springs = self._springs.at(x, values)
        self._springs.add(terms, springs)
        self._effects.add(terms, x, springs, values)
        return terms


def torque_reading(robot: Robot) -> Reading | None:
    """What the robot's torque sensor reads at one state of shape (d,), shape (n,) [N m], and its derivative, (n, d)."""
    sensor = robot.torque_sensor
    if sensor is None:
        return None
    springs, values = SpringTorques(robot), robot.values
    scale, offset = sensor.scale_and_offset(values)

    def read(x: Array) -> tuple[Array, Array]:
        torque, by_state, _ = springs.with_derivatives(x[None], values)
        return scale * torque[0] + offset, scale[:, None] * by_state[0]

    return read
