# SPDX-License-Identifier: BSD-3-Clause
"""Eliminates all states of a recording at once: a Cholesky factorisation of their band.

A chain of states of size d has a Hessian of bandwidth 2d - 1. With A = L L' the shared values see the Schur complement

    S = C - W' W,   W = L^-1 B,   s = g_p - W' w,   w = L^-1 g_x

and the states follow as dx = -L^-T (w + W dp). The cost is linear in the number of ticks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Elimination:
    """The factorised chain of one recording.

    Attributes:
        columns: banded Cholesky factor L, column by column from its diagonal on, shape (m, d, 2d).
        W: L^-1 B, shape (m d, p).
        w: L^-1 g_x, shape (m d,).
        S: Hessian on the shared values after elimination, shape (p, p).
        s: gradient on the shared values after elimination, shape (p,).
        d: size of a state.
    """

    columns: Array
    W: Array
    w: Array
    S: Array
    s: Array
    d: int

    @property
    def L(self) -> Array:
        """The factor as LAPACK stores a lower band, shape (2d, m d)."""
        return self.columns.reshape(len(self.w), 2 * self.d).T

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the states' Hessian A."""
        return 2.0 * float(np.log(self.columns[:, :, 0]).sum())

    def states(self, dp: Array) -> Array:
        """Change of all states for a change dp of the shared values, shape (m, d)."""
        return self.solve_transposed(-(self.w + self.W @ dp)[:, None])[:, 0].reshape(len(self.w) // self.d, self.d)

    def blocks(self) -> tuple[Array, Array]:
        """Blocks of L on and below the diagonal, shape (m, d, d) and (m - 1, d, d)."""
        columns = self.columns
        m, d = len(columns), self.d
        diagonal, below = np.zeros((m, d, d)), np.zeros((max(m - 1, 0), d, d))
        for b in range(d):
            diagonal[:, b:, b] = columns[:, b, : d - b]
            below[:, :, b] = columns[:-1, b, d - b : 2 * d - b]
        return diagonal, below

    def solve_transposed(self, right: Array) -> Array:
        """L^-T times a matrix of shape (m d, k)."""
        from jointscope.graphs.kernels.band_kernel import solve_back  # numba takes half a second to import

        x = np.array(right, dtype=np.float64, order="C")
        solve_back(self.columns, x)
        return x


def eliminate(system: NormalEquations, damping: float | Array = 0.0, first_tick: int = 0) -> Elimination:
    """Factorises the chain and forms the Schur complement.

    Args:
        system: normal equations.
        damping: Levenberg-Marquardt lambda, relative to the diagonal; of all ticks, or of each, shape (m,).
        first_tick: tick of the first state, for messages.

    Raises:
        SolveError: a state is not determined.
    """
    m, d, p = system.B.shape
    if m == 0:
        return Elimination(np.zeros((0, d, 2 * d)), np.zeros((0, p)), np.zeros(0), system.C, system.g_p, d)
    from jointscope.graphs.kernels.band_kernel import factorise  # numba takes half a second to import

    right = np.empty((m, d, p + 1))
    right[:, :, :p], right[:, :, p] = system.B, system.g_x
    columns = np.zeros((m, d, 2 * d))
    scale = np.broadcast_to(1.0 + np.asarray(damping, dtype=float), m)
    D, E, scale = (np.ascontiguousarray(a, dtype=float) for a in (system.D, system.E, scale))
    check_pivots(factorise(D, E, scale, columns, right), d, first_tick)
    Ww = right.reshape(m * d, p + 1)
    square = Ww.T @ Ww
    S, s = system.C - square[:p, :p], system.g_p - square[:p, p]
    return Elimination(columns, Ww[:, :p], Ww[:, p], S, s, d)


def check_pivots(info: int, d: int, first_tick: int) -> None:
    """Raises SolveError where a kernel says that a pivot is not positive."""
    if info > 0:
        tick, component = divmod(info - 1, d)
        raise SolveError(
            f"the state at tick {first_tick + tick} (component {component} of {d}) is not determined by the recording: "
            "its Hessian is not positive definite; either no sample sees it, or the estimate ran away because "
            "the model contradicts the recording (a wrong sign, axis or unit, a sensor that stopped)"
        )
