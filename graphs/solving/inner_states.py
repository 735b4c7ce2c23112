# SPDX-License-Identifier: BSD-3-Clause
"""The states between the ends of a stretch, eliminated.

[ A  B ] [inner]      B: inner states against the rim (first state, last state, free blocks), C: the rim alone
[ B' C ] [ rim ]

Only the square of what the rim sees is kept: H = C - B' A^-1 B. How the inner states follow, -A^-1 (g + B d_rim), is
solved anew for each change of the rim, from the factor of A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.solving.banded_solver import check_pivots
from jointscope.graphs.solving.normal_equations import NormalEquations

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InnerStates:
    """A stretch without its inner states.

    Attributes:
        H: Hessian on the rim, shape (n, n).
        g: gradient on the rim, shape (n,).
        gain: how much the cost falls where the inner states go to their minimum and the rim stays.
        columns: Cholesky factor of A, see `Elimination`.
    """

    H: Array
    g: Array
    gain: float
    columns: Array

    @staticmethod
    def of(system: NormalEquations, kept: NDArray[np.intp], damping: Array, start: int) -> InnerStates:
        """Eliminates all states but the first and the last.

        Args:
            system: normal equations of the stretch.
            kept: columns of the free blocks in its border.
            damping: Levenberg-Marquardt lambda of each state, relative to the diagonal, shape (m,).
            start: tick of the first state, for messages.

        Raises:
            SolveError: a state is not determined.
        """
        from jointscope.graphs.kernels.band_kernel import condense  # numba takes half a second to import

        m, d, _ = system.B.shape
        q, n = len(kept), len(kept) + 2 * d
        columns, square = np.zeros((m - 2, d, 2 * d)), np.zeros((n + 1, n + 1))
        info = condense(system.D, system.E, system.B, system.g_x, kept, 1.0 + damping, columns, square)
        check_pivots(info, d, start + 1)
        square += np.tril(square, -1).T
        order = np.concatenate([np.arange(1 + q, 1 + n), np.arange(1, 1 + q)])
        H, g = _rim(system, kept, damping)
        H -= square[np.ix_(order, order)]
        return InnerStates(H, g - square[order, 0], 0.5 * float(square[0, 0]), columns)

    def states(self, system: NormalEquations, first: Array, last: Array, change: Array) -> Array:
        """Change of the inner states for changes of the rim, shape (m - 2, d).

        Args:
            system: what was eliminated.
            first: change of the first state, shape (d,).
            last: change of the last state, shape (d,).
            change: of all shared values, shape (p,).
        """
        from jointscope.graphs.kernels.band_kernel import solve_back, solve_forth  # as above

        right = -(system.g_x[1:-1] + system.B[1:-1] @ change)
        if len(right):
            right[0] -= system.E[0] @ first
            right[-1] -= system.E[-1].T @ last
        flat = right.ravel()
        solve_forth(self.columns, flat)
        solve_back(self.columns, flat[:, None])
        return right


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
