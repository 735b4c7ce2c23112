# SPDX-License-Identifier: BSD-3-Clause
"""Euler dynamics, eq. (31) of Schuethe, Wenk, Frese (2016): x_(k+1) = x_k + h f(x_k, u_k).

Variables: X(k), X(k+1), dynamics. Local error of order h^2: at 1 ms it looks like half a sample of command delay.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Linearization
from jointscope.factors.step import selectors

Array = NDArray[np.float64]


class EulerDynamics(DynamicsFactor):
    """d_v = v1 - v0 - h a(x0, u), d_q = q1 - q0 - h v0."""

    behind = 1.0

    def defects(self, x0: Array, x1: Array, parameters: Array) -> tuple[Array, Array]:
        """Defects of velocities with memories, shape (m, r), and of positions, shape (m, k)."""
        return self._defects(
            x0, x1, self.model.accelerations(x0, self.command(parameters), parameters, self.steps.begins)
        )

    def linearize_pairs(self, x0: Array, x1: Array, calibration: Calibration) -> Linearization:
        """Defects and derivatives for m pairs of states."""
        h = self.steps.h[:, None, None]
        Q, V = selectors(self.model.layout)
        a = self.model.with_derivatives(
            x0, self.command(calibration.values), calibration.values, None, self.steps.begins
        )
        return self.assemble(
            self._defects(x0, x1, a.value),
            (-V - h * a.by_state, -Q - h * V[: len(Q)]),
            (np.broadcast_to(V, a.by_state.shape), np.broadcast_to(Q, (len(x0), *Q.shape))),
            (-h * a.by_parameter, np.zeros_like(a.by_parameter[:, : len(Q)])),
            calibration,
            a,
        )

    def _defects(self, x0: Array, x1: Array, a: Array) -> tuple[Array, Array]:
        h, layout = self.steps.h[:, None], self.model.layout
        v0 = x0[:, layout.velocities]
        return x1[:, layout.rates] - x0[:, layout.rates] - h * a, (x1 - x0)[:, layout.positions] - h * v0
