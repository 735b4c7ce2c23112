# SPDX-License-Identifier: BSD-3-Clause
"""Midpoint dynamics: x_(k+1) = x_k + h f((x_k + x_(k+1)) / 2, u_k).

Variables: X(k), X(k+1), dynamics. Local error of order h^3; one evaluation of the rigid bodies per step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Linearization
from jointscope.factors.step import selectors

Array = NDArray[np.float64]


class MidpointDynamics(DynamicsFactor):
    """d_v = v1 - v0 - h a(x_mid, u), d_q = q1 - q0 - h v_mid."""

    def defects(self, x0: Array, x1: Array, parameters: Array) -> tuple[Array, Array]:
        """Defects of velocities with memories, shape (m, r), and of positions, shape (m, k)."""
        u = self.command(parameters)
        return self._defects(x0, x1, self.model.accelerations(0.5 * (x0 + x1), u, parameters, self.steps.throughout))

    def linearize_pairs(self, x0: Array, x1: Array, calibration: Calibration) -> Linearization:
        """Defects and derivatives for m pairs of states."""
        h = self.steps.h[:, None, None]
        Q, V = selectors(self.model.layout)
        u, values = self.command(calibration.values), calibration.values
        a = self.model.with_derivatives(0.5 * (x0 + x1), u, values, None, self.steps.throughout)
        half = 0.5 * h * a.by_state
        return self.assemble(
            self._defects(x0, x1, a.value),
            (-V - half, -Q - 0.5 * h * V[: len(Q)]),
            (V - half, Q - 0.5 * h * V[: len(Q)]),
            (-h * a.by_parameter, np.zeros_like(a.by_parameter[:, : len(Q)])),
            calibration,
            a,
        )

    def _defects(self, x0: Array, x1: Array, a: Array) -> tuple[Array, Array]:
        h, layout = self.steps.h[:, None], self.model.layout
        moved = (x0 + x1)[:, layout.velocities]
        return (x1 - x0)[:, layout.rates] - h * a, (x1 - x0)[:, layout.positions] - 0.5 * h * moved
