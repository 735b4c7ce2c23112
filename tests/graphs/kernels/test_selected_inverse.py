# SPDX-License-Identifier: BSD-3-Clause
"""The compiled recursion over a factorised chain against the dense inverse."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.kernels.band_kernel import factorise
from jointscope.graphs.kernels.selected_inverse import absorb, selected_inverse


def _chain(rng: np.random.Generator, m: int, d: int) -> tuple[np.ndarray, np.ndarray]:
    """A positive definite chain as a dense matrix, and the columns of its factor."""
    A = np.zeros((m * d, m * d))
    for k in range(m):
        J = rng.normal(size=(3 * d, min(2 * d, (m - k) * d)))
        own = slice(k * d, k * d + J.shape[1])
        A[own, own] += J.T @ J
    blocks = A.reshape(m, d, m, d)
    D = np.array([blocks[k, :, k] for k in range(m)])
    E = np.array([blocks[k + 1, :, k] for k in range(m - 1)]).reshape(m - 1, d, d)
    columns = np.zeros((m, d, 2 * d))
    assert factorise(D, E, np.ones(m), 0, columns, np.zeros((m, d, 0))) == 0
    return A, columns


@pytest.mark.parametrize(("m", "d"), [(7, 12), (4, 3), (1, 2), (5, 1)])
def test_blocks_equal_those_of_the_dense_inverse(m, d):
    A, columns = _chain(np.random.default_rng(2), m, d)
    wanted = np.linalg.inv(A).reshape(m, d, m, d)
    P, neighbours = np.empty((m, d, d)), np.empty((m - 1, d, d))
    selected_inverse(columns, P, neighbours)
    for k in range(m):
        np.testing.assert_allclose(P[k], wanted[k, :, k], rtol=1e-8, atol=1e-10)
        if k < m - 1:
            np.testing.assert_allclose(neighbours[k], wanted[k, :, k + 1], rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("states", [0, 1, 2])
@pytest.mark.parametrize("p", [0, 5])
def test_leverage_is_the_variance_of_a_row_under_the_joint_covariance(states, p):
    rng, m, d, rows = np.random.default_rng(4), 5, 3, 2
    A, _ = _chain(rng, m, d)
    cov, response = np.linalg.inv(A), rng.normal(size=(m, d, p))
    root = rng.normal(size=(p, p))
    shared, blocks = root @ root.T, cov.reshape(m, d, m, d)
    given = np.array([blocks[k, :, k] for k in range(m)])
    neighbours = np.array([blocks[k, :, k + 1] for k in range(m - 1)])
    ticks = np.array([0, 2, 3])
    J = [rng.normal(size=(3, rows, d)) * (rng.random(d) < 0.7) for _ in range(states)]
    own = rng.normal(size=(3, rows, p))
    by_shared, leverage, none = own.copy(), np.empty((3, rows)), np.zeros((0, rows, d))
    absorb(*[*J, none, none][:2], ticks, given, neighbours, response, shared, by_shared, leverage)
    X = response.reshape(m * d, p)
    joint = np.block([[cov + X @ shared @ X.T, -X @ shared], [-(X @ shared).T, shared]])
    for k, tick in enumerate(ticks):
        for row in range(rows):
            full = np.zeros(m * d + p)
            full[m * d :] = own[k, row]
            for i, J_i in enumerate(J):
                full[(tick + i) * d : (tick + i + 1) * d] = J_i[k, row]
            assert leverage[k, row] == pytest.approx(full @ joint @ full, rel=1e-9)
            followed = full[m * d :] - X.T @ full[: m * d]
            np.testing.assert_allclose(by_shared[k, row], followed, rtol=1e-10, atol=1e-12)
