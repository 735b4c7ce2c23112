# SPDX-License-Identifier: BSD-3-Clause
"""The compiled derivatives of a step against the same equations in arrays."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.factors.step_kernel import combine, step_derivatives


@pytest.mark.parametrize(("k", "memories", "p"), [(6, 0, 12), (2, 1, 3), (1, 0, 0)])
def test_derivatives_of_a_step_equal_those_in_arrays(k, memories, p):
    rng, m, r = np.random.default_rng(3), 5, k + memories
    d = 2 * k + memories
    columns = rng.permutation(d)
    positions, rates = columns[:k], columns[k:]
    h = rng.uniform(0.5, 2.0, m)
    A0, A_mid, A1 = rng.normal(size=(3, m, r, d))
    P0, P_mid, P1 = rng.normal(size=(3, m, r, p))
    A_mid[:, :, rates[0]] = 0.0
    Q, V, length = np.eye(d)[positions], np.eye(d)[rates], h[:, None, None]
    by_q_mid, by_v_mid = A_mid[:, :, positions], length / 8.0 * A_mid[:, :, rates]
    mid_by_x0, mid_by_x1 = 0.5 * A_mid + by_v_mid @ A0, 0.5 * A_mid - by_v_mid @ A1
    mid_by_x0[:, :, rates[:k]] += length / 8.0 * by_q_mid
    mid_by_x1[:, :, rates[:k]] -= length / 8.0 * by_q_mid
    sixth, twelfth, half = length / 6.0, length**2 / 12.0, 0.5 * length * V[:k]
    wanted = (
        -V - sixth * (A0 + 4.0 * mid_by_x0),
        -Q - half - twelfth * A0[:, :k],
        V - sixth * (A1 + 4.0 * mid_by_x1),
        Q - half + twelfth * A1[:, :k],
        -sixth * (P0 + 4.0 * (P_mid + by_v_mid @ (P0 - P1)) + P1),
        -twelfth * (P0 - P1)[:, :k],
    )
    found = [np.empty(part.shape) for part in wanted]
    step_derivatives(h, positions, rates, A0, A_mid, A1, P0, P_mid, P1, *found)
    for got, part in zip(found, wanted, strict=True):
        np.testing.assert_allclose(got, part, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("n", [0, 2, 3])
def test_weights_act_on_link_rows_of_velocities_and_positions(n):
    rng, m, r, k = np.random.default_rng(5), 4, 5, 3
    weight, half = rng.normal(size=(m, n, n)), rng.uniform(0.1, 1.0, m)
    d_v, d_q = rng.normal(size=(m, r, 7)), rng.normal(size=(m, k, 7))
    W = np.tile(np.eye(r), (m, 1, 1))
    W[:, :n, :n] = weight
    wanted = np.concatenate([W @ d_v, W[:, :k, :k] @ (d_q - half[:, None, None] * d_v[:, :k])], axis=1)
    found = np.empty(wanted.shape)
    combine(weight, half, d_v, d_q, found)
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-13)
