# SPDX-License-Identifier: BSD-3-Clause
"""The compiled filter against the Cholesky factor of the covariance, block by block."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.kernels.innovations import innovations


@pytest.mark.parametrize(("memory", "white"), [(0.005, 3.0), (0.05, 0.3), (0.5, 0.03)])
def test_the_filter_whitens_as_the_cholesky_factor_does_also_where_samples_are_missing(memory, white):
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.choice([0.008, 0.3], size=60, p=[0.9, 0.1]))
    blocks = np.repeat([0, 1, 2], [25, 1, 34])
    values = rng.normal(size=(60, 3))
    got, logarithms = innovations(times, values, blocks, memory, white)
    wanted, total = np.empty_like(values), 0.0
    for block in range(3):
        own = blocks == block
        covariance = np.exp(-np.abs(np.subtract.outer(times[own], times[own])) / memory) + white**2 * np.eye(own.sum())
        L = np.linalg.cholesky(covariance)
        wanted[own] = np.linalg.solve(L, values[own])
        total += float(np.sum(np.log(np.diag(L))))
    np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-9)
    assert logarithms == pytest.approx(total, rel=1e-9)


def test_values_without_columns_stay_so():
    found, _ = innovations(np.arange(3.0), np.zeros((3, 0)), np.zeros(3, np.intp), 0.1, 0.1)
    assert found.shape == (3, 0)
