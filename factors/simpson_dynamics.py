# SPDX-License-Identifier: BSD-3-Clause
"""Simpson dynamics (Hermite-Simpson collocation, Lobatto IIIA of order 4).

    v1 - v0 = h/6 (a0 + 4 a_mid + a1),       v_mid = (v0 + v1)/2 + h/8 (a0 - a1)
    q1 - q0 = h/2 (v0 + v1) + h^2/12 (a0 - a1), q_mid = (q0 + q1)/2 + h/8 (v0 - v1)

Variables: X(k), X(k+1), dynamics. Local error of order h^5. The command is constant over a step, so a0 and a1 are
taken with the command of this step; along a chain the rigid bodies are evaluated once per tick and once between.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Linearization
from jointscope.factors.step import positions_of, selectors, velocities_of
from jointscope.robots.elastic_joints import Accelerations, RigidDerivatives

Array = NDArray[np.float64]


class SimpsonDynamics(DynamicsFactor):
    """Defects of the Hermite-Simpson rule."""

    def defects(self, x0: Array, x1: Array, parameters: Array) -> tuple[Array, Array]:
        """Velocity and position defects, shape (m, 2n) each."""
        u = self.steps.u
        a0 = self.model.accelerations(x0, u, parameters)
        a1 = self.model.accelerations(x1, u, parameters)
        a_mid = self.model.accelerations(self._middle(x0, x1, a0, a1), u, parameters)
        return self._defects(x0, x1, a0, a_mid, a1)

    def linearize_pairs(self, x0: Array, x1: Array, calibration: Calibration) -> Linearization:
        """Defects and derivatives for m pairs of states."""
        values, u = calibration.values, self.steps.u
        a0 = self.model.with_derivatives(x0, u, values)
        a1 = self.model.with_derivatives(x1, u, values)
        return self._linearize(x0, x1, a0, a1, calibration)

    def linearize_chain(self, x: Array, calibration: Calibration) -> Linearization:
        """As `linearize_pairs`, with the derivatives of the rigid bodies evaluated once per tick.

        Between two ticks they are taken as the mean; that changes the Jacobian by parts per million (a test says how
        much), the residual not at all.
        """
        values, u = calibration.values, self.steps.u
        at_ticks = self.model.without_command(x, values)
        a0 = self.model.with_command(_part(at_ticks, slice(None, -1)), u, values)
        a1 = self.model.with_command(_part(at_ticks, slice(1, None)), u, values)
        return self._linearize(x[:-1], x[1:], a0, a1, calibration, at_ticks.rigid.between())

    def _middle(self, x0: Array, x1: Array, a0: Array, a1: Array) -> Array:
        n, h = self.model.n, self.steps.h[:, None]
        v, a = h / 8.0 * (velocities_of(x0) - velocities_of(x1)), h / 8.0 * (a0 - a1)
        return 0.5 * (x0 + x1) + np.hstack([v[:, :n], a[:, :n], v[:, n:], a[:, n:]])

    def _defects(self, x0: Array, x1: Array, a0: Array, a_mid: Array, a1: Array) -> tuple[Array, Array]:
        h = self.steps.h[:, None]
        v0, v1 = velocities_of(x0), velocities_of(x1)
        d_v = v1 - v0 - h / 6.0 * (a0 + 4.0 * a_mid + a1)
        d_q = positions_of(x1) - positions_of(x0) - 0.5 * h * (v0 + v1) - h**2 / 12.0 * (a0 - a1)
        return d_v, d_q

    def _linearize(
        self,
        x0: Array,
        x1: Array,
        a0: Accelerations,
        a1: Accelerations,
        calibration: Calibration,
        rigid: RigidDerivatives | None = None,
    ) -> Linearization:
        n, h = self.model.n, self.steps.h[:, None, None]
        Q, V = selectors(n)
        middle = self._middle(x0, x1, a0.value, a1.value)
        mid = self.model.with_derivatives(middle, self.steps.u, calibration.values, rigid)
        velocity_columns = np.r_[n : 2 * n, 3 * n : 4 * n]
        position_columns = np.r_[0:n, 2 * n : 3 * n]
        by_q_mid, by_v_mid = mid.by_state[:, :, position_columns], h / 8.0 * mid.by_state[:, :, velocity_columns]
        # how a_mid follows x0 and x1 through the middle state
        mid_by_x0 = 0.5 * mid.by_state + by_v_mid @ a0.by_state
        mid_by_x1 = 0.5 * mid.by_state - by_v_mid @ a1.by_state
        mid_by_x0[:, :, velocity_columns] += h / 8.0 * by_q_mid
        mid_by_x1[:, :, velocity_columns] -= h / 8.0 * by_q_mid
        mid_by_parameter = mid.by_parameter + by_v_mid @ (a0.by_parameter - a1.by_parameter)
        sixth, twelfth = h / 6.0, h**2 / 12.0
        return self.assemble(
            self._defects(x0, x1, a0.value, mid.value, a1.value),
            (-V - sixth * (a0.by_state + 4.0 * mid_by_x0), -Q - 0.5 * h * V - twelfth * a0.by_state),
            (V - sixth * (a1.by_state + 4.0 * mid_by_x1), Q - 0.5 * h * V + twelfth * a1.by_state),
            (
                -sixth * (a0.by_parameter + 4.0 * mid_by_parameter + a1.by_parameter),
                -twelfth * (a0.by_parameter - a1.by_parameter),
            ),
            calibration,
        )


def _part(a: Accelerations, samples: slice) -> Accelerations:
    return replace(a, value=a.value[samples], by_state=a.by_state[samples], by_parameter=a.by_parameter[samples])
