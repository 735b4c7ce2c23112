# SPDX-License-Identifier: BSD-3-Clause
"""The compiled squares of rows against products of whole arrays."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.kernels.accumulation import add_squares


def _random_system(rng: np.random.Generator, n: int, d: int, p: int, split: bool) -> list[np.ndarray]:
    """D, E, B, C, g_x, g_p, costs, D_next and g_next that are not empty."""
    shapes = [(n, d, d), (n - 1, d, d), (n, d, p), (p, p), (n, d), (p,), (n,)]
    shapes += [(n, d, d), (n, d)] if split else [(0, d, d), (0, d)]
    return [rng.normal(size=shape) for shape in shapes]


def _expected(system, weights, r, P, J, ticks, places):
    """The same system with products of arrays added, and half the sum of squares."""
    D, E, B, C, g_x, g_p, costs, D_next, g_next = (part.copy() for part in system)
    r, P, J = weights * r, weights[:, :, None] * P, [weights[:, :, None] * J_i for J_i in J]
    np.add.at(C, np.ix_(places, places), np.einsum("kri,krj->ij", P, P))
    np.add.at(g_p, places, np.einsum("kri,kr->i", P, r))
    if J:
        np.add.at(costs, ticks, 0.5 * np.sum(r**2, axis=1))
    for i, J_i in enumerate(J):
        square, gradient = np.einsum("kri,krj->kij", J_i, J_i), np.einsum("kri,kr->ki", J_i, r)
        border = np.zeros((len(r), *B.shape[1:]))
        border[:, :, places] = np.einsum("kri,krj->kij", J_i, P)
        for target, values in ((D, square), (B, border), (g_x, gradient)):
            np.add.at(target, ticks + i, values)
        if i == 0 and len(J) == 2 and len(D_next):
            np.add.at(D_next, ticks, square)
            np.add.at(g_next, ticks, gradient)
    if len(J) == 2:
        np.add.at(E, ticks, np.einsum("kri,krj->kij", J[1], J[0]))
    return (D, E, B, C, g_x, g_p, costs, D_next, g_next), 0.5 * np.sum(r**2)


@pytest.mark.parametrize("states", [0, 1, 2])
@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize(("d", "rows", "p", "q"), [(12, 12, 24, 24), (18, 3, 30, 5), (4, 1, 7, 0), (1, 2, 0, 0)])
def test_the_kernel_equals_products_of_arrays_also_where_samples_share_a_state(states, split, d, rows, p, q):
    rng = np.random.default_rng(11)
    n, m = 7, 40
    ticks, places = np.sort(rng.integers(0, n - 1, m)).astype(np.intp), rng.permutation(p)[:q].astype(np.intp)
    weights, r, P = rng.uniform(0.1, 3.0, (m, rows)), rng.normal(size=(m, rows)), rng.normal(size=(m, rows, q))
    J = [rng.normal(size=(m, rows, d)) * (rng.random(d) < 0.7) for _ in range(states)]
    system = _random_system(rng, n, d, p, split)
    wanted, total = _expected(system, weights, r, P, J, ticks, places)
    none = np.zeros((0, rows, d))
    assert add_squares(weights, r, P, *[*J, none, none][:2], ticks, places, *system) == pytest.approx(total, rel=1e-12)
    for got, part in zip(system, wanted, strict=True):
        np.testing.assert_allclose(got, part, rtol=1e-12, atol=1e-12 * np.abs(part).max(initial=0.0))


def test_a_value_that_is_not_a_number_is_not_lost():
    J, r, none = np.ones((1, 1, 2)), np.ones((1, 1)), np.zeros((0, 1, 2))
    J[0, 0, 1] = np.nan
    system = _random_system(np.random.default_rng(1), 2, 2, 0, split=False)
    at, places = np.zeros(1, dtype=np.intp), np.zeros(0, dtype=np.intp)
    add_squares(np.ones((1, 1)), r, np.zeros((1, 1, 0)), J, none, at, places, *system)
    D, g_x = system[0], system[4]
    assert np.isnan(D[0, 1]).all() and np.isnan(g_x[0, 1])
