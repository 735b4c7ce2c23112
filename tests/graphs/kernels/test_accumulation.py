# SPDX-License-Identifier: BSD-3-Clause
"""The compiled sums of Jacobians against products of whole arrays."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.kernels.accumulation import add_products


@pytest.mark.parametrize(("d", "rows", "p", "q"), [(12, 12, 24, 24), (18, 3, 30, 5), (4, 1, 7, 0), (1, 2, 0, 0)])
def test_the_kernel_equals_products_of_arrays_also_where_samples_share_a_state(d, rows, p, q):
    rng = np.random.default_rng(11)
    n, m = 6, 40
    states = np.sort(rng.integers(0, n, m)).astype(np.intp)
    places = rng.permutation(p)[:q].astype(np.intp)
    J, right = rng.normal(size=(m, rows, d)), rng.normal(size=(m, rows, q + 1))
    J[:, :, rng.random(d) < 0.3] = 0.0
    D, B, g = rng.normal(size=(n, d, d)), rng.normal(size=(n, d, p)), rng.normal(size=(n, d))
    wanted_D, wanted_B, wanted_g = D.copy(), B.copy(), g.copy()
    np.add.at(wanted_D, states, np.einsum("kri,krj->kij", J, J))
    products = np.einsum("kri,krc->kic", J, right)
    by_border = np.zeros((m, d, p))
    by_border[:, :, places] = products[:, :, :q]
    np.add.at(wanted_B, states, by_border)
    np.add.at(wanted_g, states, products[:, :, q])
    add_products(J, right, D, B, g, states, places)
    for got, wanted in ((D, wanted_D), (B, wanted_B), (g, wanted_g)):
        np.testing.assert_allclose(got, wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max(initial=0.0))


def test_a_value_that_is_not_a_number_is_not_lost():
    J, right = np.ones((1, 1, 2)), np.ones((1, 1, 1))
    J[0, 0, 1] = np.nan
    D, B, g = np.zeros((1, 2, 2)), np.zeros((1, 2, 0)), np.zeros((1, 2))
    none = np.zeros(0, dtype=np.intp)
    add_products(J, right, D, B, g, np.zeros(1, dtype=np.intp), none)
    assert np.isnan(D[0, 1]).all() and np.isnan(g[0, 1])
