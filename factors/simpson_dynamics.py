# SPDX-License-Identifier: BSD-3-Clause
"""Simpson dynamics (Hermite-Simpson collocation, Lobatto IIIA of order 4).

    v1 - v0 = h/6 (a0 + 4 a_mid + a1),       v_mid = (v0 + v1)/2 + h/8 (a0 - a1)
    q1 - q0 = h/2 (v0 + v1) + h^2/12 (a0 - a1), q_mid = (q0 + q1)/2 + h/8 (v0 - v1)

Variables: X(k), X(k+1), dynamics. Local error of order h^5. The command is constant over a step, so a0 and a1 are
taken with the command of this step; a drive signal that was measured is linear over it. Along a chain the rigid bodies
are evaluated once per tick and once between.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Linearization
from jointscope.robots.dynamics.accelerations import Accelerations, RigidDerivatives

Array = NDArray[np.float64]


class SimpsonDynamics(DynamicsFactor):
    """Defects of the Hermite-Simpson rule."""

    def defects(self, x0: Array, x1: Array, parameters: Array) -> tuple[Array, Array]:
        """Defects of velocities with memories, shape (m, r), and of positions, shape (m, k)."""
        u, steps, (first, last) = self.command(parameters), self.steps, self.commands_at_ends(parameters)
        a0 = self.model.accelerations(x0, first, parameters, steps.begins)
        a1 = self.model.accelerations(x1, last, parameters, steps.ends)
        a_mid = self.model.accelerations(self.middle(x0, x1, a0, a1), u, parameters, steps.throughout)
        return self._defects(x0, x1, a0, a_mid, a1)

    def linearize_pairs(self, x0: Array, x1: Array, calibration: Calibration) -> Linearization:
        """Defects and derivatives for m pairs of states."""
        values = calibration.values
        first, last = self.commands_at_ends(values)
        a0 = self.model.with_derivatives(x0, first, values, None, self.steps.begins)
        a1 = self.model.with_derivatives(x1, last, values, None, self.steps.ends)
        return self._linearize(x0, x1, a0, a1, calibration)

    def linearize_neighbours(self, x: Array, calibration: Calibration) -> Linearization:
        """As `linearize_pairs`, with the derivatives of the rigid bodies evaluated once per tick.

        Between two ticks they are taken as the mean; that changes the Jacobian by parts per million (a test says how
        much), the residual not at all.
        """
        values = calibration.values
        a0, a1, rigid = self.model.at_ticks(x, self.commands_at_ends(values), values, self.steps.at_ticks)
        return self._linearize(x[:-1], x[1:], a0, a1, calibration, rigid)

    def middle(self, x0: Array, x1: Array, a0: Array, a1: Array) -> Array:
        """States in the middle of m steps, from states and accelerations at both ends, shape (m, d)."""
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
        from jointscope.factors.step_kernel import step_derivatives  # numba takes half a second to import

        layout, values = self.model.layout, calibration.values
        middle = self.middle(x0, x1, a0.value, a1.value)
        mid = self.model.with_derivatives(middle, self.command(values), values, rigid, self.steps.throughout)
        m, r, d = mid.by_state.shape
        k, p = len(layout.positions), mid.by_parameter.shape[2]
        by_x0, by_x1, by_p = ((np.empty((m, r, c)), np.empty((m, k, c))) for c in (d, d, p))
        ends = [np.ascontiguousarray(part) for part in (a0.by_state, mid.by_state, a1.by_state)]
        ends += [np.ascontiguousarray(part) for part in (a0.by_parameter, mid.by_parameter, a1.by_parameter)]
        step_derivatives(self.steps.h, layout.positions, layout.rates, *ends, *by_x0, *by_x1, *by_p)
        return self.assemble(
            self._defects(x0, x1, a0.value, mid.value, a1.value),
            by_x0,
            by_x1,
            by_p,
            calibration,
            mid,
        )

    def _add_commands(self, by_parameter: tuple[Array, Array], calibration: Calibration, middle: Accelerations) -> None:
        """With what effects do to the rise of a measured signal, which moves the middle and the positions."""
        super()._add_commands(by_parameter, calibration, middle)
        rises = self.steps.rising(self.model.named(calibration.values))[1]
        if not rises:
            return
        weight = self.steps.h[:, None, None] ** 2 / 12.0
        response = weight * self.model.command_response(middle, calibration.values)
        by_rates = middle.by_state[:, :, self.model.layout.rates]
        for name, slope in rises.items():
            if name in self.model.names:
                place, risen = self.model.names.index(name), response @ slope[:, :, None]
                by_parameter[0][:, :, place] += (by_rates @ risen)[:, :, 0]
                by_parameter[1][:, :, place] += risen[:, : by_parameter[1].shape[1], 0]
