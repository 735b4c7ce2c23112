# SPDX-License-Identifier: BSD-3-Clause
"""The springs and dampers between motors and links: tau_c = K (q_link - q_motor) + D (v_link - v_motor)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Springs:
    """Springs of all joints at m samples; zero for rigid joints.

    Attributes:
        stiffness, damping: shape (n,) [N m/rad], [N m s/rad].
        deflection, rate: shape (m, n) [rad], [rad/s].
        torque: shape (m, n) [N m].
        stiffness_by, damping_by: index among the free parameters and derivative by it, for each joint; -1 for none.
    """

    stiffness: Array
    damping: Array
    deflection: Array
    rate: Array
    torque: Array
    stiffness_by: Sequence[tuple[int, float]]
    damping_by: Sequence[tuple[int, float]]


class JointSprings:
    """Torques of the springs; minus tau_c on the link, plus tau_c on the motor.

    Args:
        layout: of the state.
        parameters: of the robot's joints.
    """

    def __init__(self, layout: StateLayout, parameters: JointParameters):
        self._layout, self._parameters = layout, parameters

    def at(self, x: Array, values: Mapping[str, float]) -> Springs:
        """Springs of all joints at states of shape (m, d)."""
        layout, parameters = self._layout, self._parameters
        K, D = parameters.of(values, "stiffness"), parameters.of(values, "damping")
        deflection = x[:, layout.joint_q] - x[:, layout.motor_q]
        rate = x[:, layout.joint_v] - x[:, layout.motor_v]
        by = parameters.slopes("stiffness", K), parameters.slopes("damping", D)
        return Springs(K, D, deflection, rate, K * deflection + D * rate, *by)

    def add(self, terms: TorqueTerms, springs: Springs) -> None:
        """Adds their torques to both sides."""
        layout, K, D = self._layout, springs.stiffness, springs.damping
        for i in layout.elastic_joints:
            for row, sign in ((int(layout.joint_link[i]), -1.0), (int(layout.motor_row[i]), 1.0)):
                terms.value[:, row] += sign * springs.torque[:, i]
                if terms.by_state is None or terms.by_parameter is None:
                    continue
                terms.by_state[:, row, layout.joint_q[i]] += sign * K[i]
                terms.by_state[:, row, layout.motor_q[i]] -= sign * K[i]
                terms.by_state[:, row, layout.joint_v[i]] += sign * D[i]
                terms.by_state[:, row, layout.motor_v[i]] -= sign * D[i]
                slope = springs.stiffness_by[i][1]
                by_stiffness, by_damping = sign * slope * springs.deflection[:, i], sign * springs.rate[:, i]
                self._parameters.add(terms.by_parameter, "stiffness", i, row, by_stiffness)
                self._parameters.add(terms.by_parameter, "damping", i, row, by_damping)
