# SPDX-License-Identifier: BSD-3-Clause
"""Simpson dynamics (Hermite-Simpson collocation, Lobatto IIIA of order 4).

    v1 - v0 = h/6 (a0 + 4 a_mid + a1),       v_mid = (v0 + v1)/2 + h/8 (a0 - a1)
    q1 - q0 = h/2 (v0 + v1) + h^2/12 (a0 - a1), q_mid = (q0 + q1)/2 + h/8 (v0 - v1)

Variables: X(k), X(k+1), dynamics. Local error of order h^5. The command is constant over a step, so a0 and a1 are
taken with the command of this step; along a chain the rigid bodies are evaluated once per tick and once between.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Linearization
from jointscope.factors.step import selectors
from jointscope.robots.dynamics.accelerations import Accelerations, RigidDerivatives

Array = NDArray[np.float64]


class SimpsonDynamics(DynamicsFactor):
    """Defects of the Hermite-Simpson rule."""

    def defects(self, x0: Array, x1: Array, parameters: Array) -> tuple[Array, Array]:
        """Defects of velocities with memories, shape (m, r), and of positions, shape (m, k)."""
        u = self.command(parameters)
        a0 = self.model.accelerations(x0, u, parameters)
        a1 = self.model.accelerations(x1, u, parameters)
        a_mid = self.model.accelerations(self._middle(x0, x1, a0, a1), u, parameters)
        return self._defects(x0, x1, a0, a_mid, a1)

    def linearize_pairs(self, x0: Array, x1: Array, calibration: Calibration) -> Linearization:
        """Defects and derivatives for m pairs of states."""
        values = calibration.values
        u = self.command(values)
        a0 = self.model.with_derivatives(x0, u, values)
        a1 = self.model.with_derivatives(x1, u, values)
        return self._linearize(x0, x1, a0, a1, calibration)

    def linearize_chain(self, x: Array, calibration: Calibration) -> Linearization:
        """As `linearize_pairs`, with the derivatives of the rigid bodies evaluated once per tick.

        Between two ticks they are taken as the mean; that changes the Jacobian by parts per million (a test says how
        much), the residual not at all.
        """
        values = calibration.values
        a0, a1, rigid = self.model.at_ticks(x, self.command(values), values)
        return self._linearize(x[:-1], x[1:], a0, a1, calibration, rigid)

    def _middle(self, x0: Array, x1: Array, a0: Array, a1: Array) -> Array:
        h, layout = self.steps.h[:, None], self.model.layout
        middle = 0.5 * (x0 + x1)
        middle[:, layout.positions] += h / 8.0 * (x0 - x1)[:, layout.velocities]
        middle[:, layout.rates] += h / 8.0 * (a0 - a1)
        return middle

    def _defects(self, x0: Array, x1: Array, a0: Array, a_mid: Array, a1: Array) -> tuple[Array, Array]:
        h, layout = self.steps.h[:, None], self.model.layout
        moved, k = (x0 + x1)[:, layout.velocities], len(layout.positions)
        d_v = (x1 - x0)[:, layout.rates] - h / 6.0 * (a0 + 4.0 * a_mid + a1)
        d_q = (x1 - x0)[:, layout.positions] - 0.5 * h * moved - h**2 / 12.0 * (a0 - a1)[:, :k]
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
        layout, h = self.model.layout, self.steps.h[:, None, None]
        Q, V = selectors(layout)
        k = len(Q)
        middle = self._middle(x0, x1, a0.value, a1.value)
        values = calibration.values
        mid = self.model.with_derivatives(middle, self.command(values), values, rigid)
        by_q_mid, by_v_mid = mid.by_state[:, :, layout.positions], h / 8.0 * mid.by_state[:, :, layout.rates]
        # how a_mid follows x0 and x1 through the middle state
        mid_by_x0 = 0.5 * mid.by_state + by_v_mid @ a0.by_state
        mid_by_x1 = 0.5 * mid.by_state - by_v_mid @ a1.by_state
        mid_by_x0[:, :, layout.velocities] += h / 8.0 * by_q_mid
        mid_by_x1[:, :, layout.velocities] -= h / 8.0 * by_q_mid
        mid_by_parameter = mid.by_parameter + by_v_mid @ (a0.by_parameter - a1.by_parameter)
        sixth, twelfth = h / 6.0, h**2 / 12.0
        half = 0.5 * h * V[:k]
        return self.assemble(
            self._defects(x0, x1, a0.value, mid.value, a1.value),
            (-V - sixth * (a0.by_state + 4.0 * mid_by_x0), -Q - half - twelfth * a0.by_state[:, :k]),
            (V - sixth * (a1.by_state + 4.0 * mid_by_x1), Q - half + twelfth * a1.by_state[:, :k]),
            (
                -sixth * (a0.by_parameter + 4.0 * mid_by_parameter + a1.by_parameter),
                -twelfth * (a0.by_parameter - a1.by_parameter)[:, :k],
            ),
            calibration,
            mid,
        )
