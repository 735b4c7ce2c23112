# SPDX-License-Identifier: BSD-3-Clause
"""Moments of densities that are no Gaussians, against those worked out by hand."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.rests.walkers import moments


def test_a_skewed_corner_of_a_cliff_has_the_moments_of_its_exponentials():
    # x and y are exponential with means 2 and 0.1; what is sampled are their sum and difference
    def cost(point):
        x, y = 0.5 * (point[:, 0] + point[:, 1]), 0.5 * (point[:, 0] - point[:, 1])
        return np.where((x > 0.0) & (y > 0.0), x / 2.0 + y / 0.1, np.inf)

    rng = np.random.default_rng(0)
    begin = rng.uniform(0.1, 1.0, (64, 2))
    walkers = np.column_stack([begin.sum(axis=1), begin[:, 0] - begin[:, 1]])
    mean, covariance = moments(cost, walkers, rng)
    np.testing.assert_allclose(mean, [2.1, 1.9], rtol=0.15)
    np.testing.assert_allclose(covariance, [[4.01, 3.99], [3.99, 4.01]], rtol=0.3)


def test_what_lies_beyond_a_gap_is_counted_though_all_begin_on_one_side():
    # a fifth of the density stands nine sigmas away
    def cost(point):
        far = point - np.array([9.0, 0.0])
        near = 0.8 * np.exp(-0.5 * np.sum(point**2, axis=1))
        return -np.log(np.maximum(near + 0.2 * np.exp(-0.5 * np.sum(far**2, axis=1)), 1e-300))

    rng = np.random.default_rng(1)
    mean, covariance = moments(cost, rng.normal(size=(64, 2)), rng)
    np.testing.assert_allclose(mean, [1.8, 0.0], atol=0.3)
    np.testing.assert_allclose(np.diag(covariance), [1.0 + 0.16 * 81.0, 1.0], rtol=0.15)
