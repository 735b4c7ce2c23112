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
