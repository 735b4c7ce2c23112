# SPDX-License-Identifier: BSD-3-Clause
"""The states between the ends of a stretch, eliminated.

[ A  B ] [inner]      B: inner states against the rim (first state, last state, free blocks), C: the rim alone
[ B' C ] [ rim ]

Only the square of what the rim sees is kept: H = C - B' A^-1 B. How the inner states follow, -A^-1 (g + B d_rim), is
solved anew for each change of the rim, from the factor of A.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import check_pivots
from jointscope.graphs.solving.normal_equations import NormalEquations, build
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InnerStates:
    """A stretch without its inner states.

    Attributes:
        H: Hessian on the rim, shape (n, n).
        g: gradient on the rim, shape (n,).
        gain: how much the cost falls where the inner states go to their minimum and the rim stays.
        columns: Cholesky factor of A, see `Elimination`.
        border: second derivatives by the inner states and all shared values, shape (m - 2, d, p).
        gradient: by the inner states, shape (m - 2, d).
        links: second derivatives by the first two states, and by the last two, the later one first, shape (d, d).
    """

    H: Array
    g: Array
    gain: float
    columns: Array
    border: Array
    gradient: Array
    links: tuple[Array, Array]

    @staticmethod
    def of(
        system: NormalEquations, kept: NDArray[np.intp], damping: Array, start: int, columns: Array | None = None
    ) -> InnerStates:
        """Eliminates all states but the first and the last.

        Args:
            system: normal equations of the stretch; only its B and g_x are needed afterwards, and not changed.
            kept: columns of the free blocks in its border.
            damping: Levenberg-Marquardt lambda of each state, relative to the diagonal, shape (m,).
            start: tick of the first state, for messages.
            columns: where the factor goes, shape (m - 2, d, 2d), if memory is there already.

        Raises:
            SolveError: a state is not determined.
        """
        from jointscope.graphs.kernels.band_kernel import condense  # numba takes half a second to import

        m, d, _ = system.B.shape
        q, n = len(kept), len(kept) + 2 * d
        square = np.zeros((n + 1, n + 1))
        if columns is None:
            columns = np.empty((m - 2, d, 2 * d))
        columns[:] = 0.0
        info = condense(system.D, system.E, system.B, system.g_x, kept, 1.0 + damping, columns, square)
        check_pivots(info, d, start + 1)
        square += np.tril(square, -1).T
        order = np.concatenate([np.arange(1 + q, 1 + n), np.arange(1, 1 + q)])
        H, g = _rim(system, kept, damping)
        H -= square[np.ix_(order, order)]
        left = g - square[order, 0], 0.5 * float(square[0, 0])
        links = system.E[0].copy(), system.E[-1].copy()
        return InnerStates(H, *left, columns, system.B[1:-1], system.g_x[1:-1], links)

    def states(self, first: Array, last: Array, change: Array) -> Array:
        """Change of the inner states for changes of the rim, shape (m - 2, d).

        Args:
            first: change of the first state, shape (d,).
            last: change of the last state, shape (d,).
            change: of all shared values, shape (p,).
        """
        from jointscope.graphs.kernels.band_kernel import solve_back, solve_forth  # as above

        right = -(self.gradient + self.border @ change)
        if len(right):
            right[0] -= self.links[0] @ first
            right[-1] -= self.links[1].T @ last
        flat = right.ravel()
        solve_forth(self.columns, flat)
        solve_back(self.columns, flat[:, None])
        return right


@dataclass
class Point:
    """Where a stretch was evaluated.

    Attributes:
        x: all its states, shape (m, d).
        calibration: shared values.
        cost: half the sum of squared whitened residuals there.
        costs: the share of each tick in it, shape (m,).
    """

    x: Array
    calibration: Calibration
    cost: float
    costs: Array

    def is_at(self, first: Array, last: Array, calibration: Calibration) -> bool:
        """Whether that is the same place, to the last digit."""
        return (
            np.array_equal(self.x[0], first)
            and np.array_equal(self.x[-1], last)
            and self.calibration.is_at(calibration)
        )


class LinearisedStretch:
    """Memory for one linearisation of a stretch.

    Args:
        problem: the factors of the stretch.
        kept: columns of the free blocks.
        start: tick of its first state, for messages.
        m, d, p: number of states, size of one, number of shared values.
        whole: whether the blocks of the states are kept, so that they can be eliminated with another damping; else they
            are in memory that all stretches of a thread share.

    Attributes:
        point: where that is; None where it has failed.
        damping: of each state, with which the inner ones are eliminated, shape (m,).
    """

    def __init__(
        self, problem: BagProblem, kept: NDArray[np.intp], start: int, m: int, d: int, p: int, whole: bool = False
    ):
        self.point: Point | None = None
        self.damping = np.zeros(m)
        self._problem, self._kept, self._start = problem, kept, start
        self._border, self._gradient = np.empty((m, d, p)), np.empty((m, d))
        self._columns, self._blocks = np.empty((m - 2, d, 2 * d)), np.empty((2 * m - 1, d, d)) if whole else None
        self._system: NormalEquations | None = None
        self._inner: InnerStates | None = None
        self._failure: SolveError | None = None

    @property
    def inner(self) -> InnerStates:
        """The stretch without its inner states.

        Raises:
            SolveError: a state is not determined.
        """
        if self._failure is not None:
            raise self._failure
        if self._inner is None:
            assert self._system is not None
            self._inner = InnerStates.of(self._system, self._kept, self.damping, self._start, self._columns)
        return self._inner

    def is_damped(self, damping: Array) -> bool:
        """Whether that is the damping, or can be."""
        if np.array_equal(1.0 + self.damping, 1.0 + damping):
            return True
        if self._blocks is not None:
            self.damping, self._inner = damping, None
        return self._blocks is not None

    def move(self, x: Array, calibration: Calibration, damping: Array) -> Point:
        """Linearises the stretch; inner states are eliminated at once where their blocks are not kept.

        Args:
            x: states, shape (m, d).
            calibration: shared values.
            damping: of each state, shape (m,).
        """
        self.point = self._failure = None  # neither the one place nor the other, should it fail
        m, d, p = self._border.shape
        blocks = shared_blocks(2 * m - 1, d) if self._blocks is None else self._blocks
        blocks[:], self._border[:], self._gradient[:] = 0.0, 0.0, 0.0
        shared = np.zeros((p, p)), self._gradient, np.zeros(p)
        system = NormalEquations(blocks[:m], blocks[m:], self._border, *shared, 0.0, np.zeros(m))
        build(self._problem, x, calibration, into=system)
        self._system, self._inner, self.damping = system, None, damping
        if self._blocks is None:
            try:
                _ = self.inner
            except SolveError as err:  # the cost tells soon enough that this is no place to go on from
                self._failure = err
            self._system = None
        self.point = Point(x, calibration, system.cost, system.costs)
        return self.point


_own = threading.local()  # of each thread: memory for the blocks of one stretch


def shared_blocks(count: int, d: int) -> Array:
    """Memory of shape (count, d, d) that the next stretch of this thread takes."""
    size = count * d * d
    if len(getattr(_own, "memory", ())) < size:
        _own.memory = np.empty(size)
    found: Array = _own.memory[:size].reshape(count, d, d)
    return found


def _rim(system: NormalEquations, kept: NDArray[np.intp], damping: Array) -> tuple[Array, Array]:
    """Hessian and gradient on both ends and the free blocks."""
    m, d, _ = system.B.shape
    n = 2 * d + len(kept)
    first, last, blocks = slice(0, d), slice(d, 2 * d), slice(2 * d, n)
    C = np.zeros((n, n))
    if m == 2:
        C[last, first], C[first, last] = system.E[0], system.E[0].T
    for end, k in ((first, 0), (last, -1)):
        C[end, end] = system.D[k] + damping[k] * np.diag(np.diag(system.D[k]))
        C[end, blocks], C[blocks, end] = system.B[k][:, kept], system.B[k][:, kept].T
    C[blocks, blocks] = system.C[np.ix_(kept, kept)]
    return C, np.concatenate([system.g_x[0], system.g_x[-1], system.g_p[kept]])
