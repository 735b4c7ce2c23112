# SPDX-License-Identifier: BSD-3-Clause
"""Normal equations of states that do not touch each other: rests, poses, weighings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.solving.normal_equations import NormalEquations

Array = NDArray[np.float64]


def of_independent_states(r: Array, J: Array, P: Array, costs: Array | None = None) -> NormalEquations:
    """The system of m states with k whitened residuals each.

    Args:
        r: residuals, shape (m, k).
        J: their derivative by the own state, shape (m, k, d).
        P: by the shared values, shape (m, k, p).
        costs: of each state, where they are no sums of squares, shape (m,); then J' r is the gradient and J' J stands
            for the second derivatives.
    """
    system = NormalEquations.zeros(len(r), J.shape[2], P.shape[2])
    transposed = np.swapaxes(J, 1, 2)
    system.D[:], system.B[:] = transposed @ J, transposed @ P
    system.g_x[:] = (transposed @ r[:, :, None])[:, :, 0]
    rows = P.reshape(-1, P.shape[2])
    system.C[:], system.g_p[:] = rows.T @ rows, rows.T @ r.reshape(-1)
    system.costs[:] = 0.5 * np.sum(r**2, axis=1) if costs is None else costs
    system.cost = float(np.sum(system.costs))
    return system


def reduced(system: NormalEquations) -> tuple[Array, Array]:
    """Hessian and gradient of all rests in the shared values, states eliminated, without priors."""
    solved = np.linalg.solve(system.D, np.concatenate([system.B, system.g_x[:, :, None]], axis=2))
    B = system.B
    H = system.C - np.einsum("mdp,mdq->pq", B, solved[:, :, :-1])
    g = system.g_p - np.einsum("mdp,md->p", B, solved[:, :, -1])
    return 0.5 * (H + H.T), g
