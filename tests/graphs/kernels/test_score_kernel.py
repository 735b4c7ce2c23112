# SPDX-License-Identifier: BSD-3-Clause
"""Columns of hypotheses beside a chain, against products of whole arrays; memories, against their closed form."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.kernels.band_kernel import factorise
from jointscope.graphs.kernels.implicit_steps import implicit_steps
from jointscope.graphs.kernels.score_kernel import add_border, simpson_columns, solve_forth_columns

SIZES = [(12, 16), (18, 5), (4, 1), (1, 3), (6, 1)]


@pytest.mark.parametrize(("d", "k"), SIZES)
@pytest.mark.parametrize("rows", [1, 3, 12])
def test_the_border_is_the_sum_of_products_also_where_samples_share_a_state(d, k, rows):
    rng = np.random.default_rng(5)
    ticks = np.sort(rng.integers(0, 6, 30)).astype(np.intp)
    J, Z = rng.normal(size=(30, rows, d)) * (rng.random(d) < 0.7), rng.normal(size=(30, rows, k))
    B = rng.normal(size=(7, d, k))
    wanted = B.copy()
    np.add.at(wanted, ticks, np.einsum("srd,srk->sdk", J, Z))
    add_border(J, Z, ticks, B)
    np.testing.assert_allclose(B, wanted, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("d", "k"), SIZES)
def test_columns_that_are_solved_window_after_window_are_those_of_the_whole_factor(d, k):
    rng, m = np.random.default_rng(6), 23
    J = rng.normal(size=(m, 2 * d + 1, d))
    D, E = np.einsum("kri,krj->kij", J, J) + 3.0 * d * np.eye(d), 0.3 * rng.normal(size=(m - 1, d, d))
    columns, border = np.zeros((m, d, 2 * d)), rng.normal(size=(m, d, k))
    wanted = border.copy()
    assert factorise(D, E, np.ones(m), 0, columns, wanted) == 0
    before = np.zeros((d, k))
    for start, stop in ((0, 1), (1, 9), (9, 10), (10, m)):
        part = border[start:stop]
        solve_forth_columns(columns, start, before, part)
        np.testing.assert_allclose(part, wanted[start:stop], rtol=1e-10, atol=1e-12)
        before = part[-1].copy()


@pytest.mark.parametrize(("d", "p"), SIZES)
def test_a_chain_that_is_factorised_part_by_part_is_that_of_the_whole(d, p):
    rng, m = np.random.default_rng(7), 20
    J = rng.normal(size=(m, 2 * d + 1, d))
    D, E = np.einsum("kri,krj->kij", J, J) + 3.0 * d * np.eye(d), 0.3 * rng.normal(size=(m - 1, d, d))
    border = rng.normal(size=(m, d, p))
    whole, parts = (np.zeros((m, d, 2 * d)), border.copy()), (np.zeros((m, d, 2 * d)), border.copy())
    assert factorise(D, E, np.ones(m), 0, *whole) == 0
    for start, stop in ((0, 7), (7, 8), (8, m)):
        links = E[max(start - 1, 0) : stop - 1]
        assert factorise(D[start:stop], links, np.ones(stop - start), start, *parts) == 0
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_array_equal(one, other)


def test_columns_of_simpsons_rule_move_along_in_the_middle():
    rng, (m, r, n, k) = np.random.default_rng(8), (5, 7, 6, 3)
    h, by_rates = rng.uniform(0.5, 2.0, m), rng.normal(size=(m, r, r))
    first, last, middle = rng.normal(size=(3, m, r, k))
    d_v, d_q = np.empty((m, r, k)), np.empty((m, n, k))
    simpson_columns(h, first, last, middle, by_rates, d_v, d_q)
    step = h[:, None, None]
    moved = middle + by_rates @ (step / 8.0 * (first - last))
    np.testing.assert_allclose(d_v, -step / 6.0 * (first + 4.0 * moved + last), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(d_q, -(step**2) / 12.0 * (first - last)[:, :n], rtol=1e-12, atol=1e-12)


def test_a_linear_memory_is_integrated_exactly_over_steps_of_any_length():
    h, rate = np.array([0.1, 0.5, 1e-12, 0.2]), 3.0
    z = implicit_steps(h, np.full(4, 6.0), np.full(4, -rate), np.zeros(4))
    np.testing.assert_allclose(z[1:], 2.0 * (1.0 - np.exp(-rate * np.cumsum(h))), rtol=1e-12)
