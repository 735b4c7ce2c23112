# SPDX-License-Identifier: BSD-3-Clause
"""Eliminates all states of a recording at once: a Cholesky factorisation of their band.

A chain of states of size d has a Hessian of bandwidth 2d - 1. With A = L L' the shared values see the Schur complement

    S = C - W' W,   W = L^-1 B,   s = g_p - W' w,   w = L^-1 g_x

and the states follow as dx = -L^-T (w + W dp). The cost is linear in the number of ticks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import NormalEquations, build, parts_of
from jointscope.graphs.solving.set_problem import Problem
from jointscope.graphs.solving.solver_context import side_by_side
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]

PART = 1000  # steps whose normal equations exist at once


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
    check_pivots(factorise(D, E, scale, 0, columns, right), d, first_tick)
    Ww = right.reshape(m * d, p + 1)
    square = Ww.T @ Ww
    S, s = system.C - square[:p, :p], system.g_p - square[:p, p]
    return Elimination(columns, Ww[:, :p], Ww[:, p], S, s, d)


def eliminate_recording(problem: BagProblem, x: Array, calibration: Calibration) -> Elimination:
    """As `eliminate` of the normal equations of a recording, which exist for some ticks at a time only.

    Args:
        problem: its factors.
        x: states, shape (m, d).
        calibration: shared values.

    Raises:
        SolveError: a state is not determined.
    """
    from jointscope.graphs.kernels.band_kernel import factorise  # as above

    (m, d), p = x.shape, calibration.size
    right, columns, square = np.empty((m, d, p + 1)), np.zeros((m, d, 2 * d)), np.zeros((p + 1, p + 1))
    alone = replace(problem, placed=tuple(placed for placed in problem.placed if placed.factor.states == 0))
    rest = build(replace(alone, dynamics=problem.dynamics.select(slice(0, 0))), x[:2], calibration)
    C, g_p, before = rest.C, rest.g_p, None

    def built(part: tuple[int, int, BagProblem]) -> tuple[int, int, NormalEquations]:
        a, b, samples = part
        return a, b, build(samples, x[a : b + 1], calibration)

    for a, b, system in side_by_side(built, parts_of(problem, PART)):
        C, g_p, end = C + system.C, g_p + system.g_p, b + int(b == m - 1)
        if before is not None:  # the last state of a part is the first one of the next
            for own, last in zip((system.D, system.B, system.g_x), before[:3], strict=True):
                own[0] += last
        E = system.E if before is None else np.concatenate([before[3], system.E])
        ticks = slice(a, end)
        right[ticks, :, :p], right[ticks, :, p] = system.B[: end - a], system.g_x[: end - a]
        check_pivots(factorise(system.D[: end - a], E, np.ones(end - a), a, columns, right), d, 0)
        part = right[ticks].reshape(-1, p + 1)
        square += part.T @ part
        before = system.D[-1], system.B[-1], system.g_x[-1], system.E[-1:]
    Ww = right.reshape(m * d, p + 1)
    return Elimination(columns, Ww[:, :p], Ww[:, p], C - square[:p, :p], g_p - square[:p, p], d)


def eliminations_of(problems: Sequence[Problem], estimate: Estimate) -> list[Elimination]:
    """The states of recordings of any kind eliminated, linearised where they are."""
    found = []
    for problem, x, calibration in zip(problems, estimate.states, estimate.calibrations, strict=True):
        if isinstance(problem, BagProblem):
            found.append(eliminate_recording(problem, x, calibration))
        else:
            found.append(eliminate(problem.linearize(x, calibration)))
    return found


def check_pivots(info: int, d: int, first_tick: int) -> None:
    """Raises SolveError where a kernel says that a pivot is not positive."""
    if info > 0:
        tick, component = divmod(info - 1, d)
        raise SolveError(
            f"the state at tick {first_tick + tick} (component {component} of {d}) is not determined by the recording: "
            "its Hessian is not positive definite; either no sample sees it, or the estimate ran away because "
            "the model contradicts the recording (a wrong sign, axis or unit, a sensor that stopped)"
        )
