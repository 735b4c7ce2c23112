# SPDX-License-Identifier: BSD-3-Clause
"""The information of shaken poses where neighbouring lines have causes in common."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.frequency.linear_responses import LinearResponses
from jointscope.graphs.joint_kinds.linear_kinds import LinearKinds
from jointscope.robots.geometry.arm_effects import FREQUENCY

BANDS, ROWS = 60, 40


def responses(size, common=0.0, seed=0):
    """Rows with an effect of some size, whose column is much like another one; and that column."""
    rng = np.random.default_rng(seed)
    n = BANDS * ROWS
    band = np.repeat(np.arange(BANDS), ROWS)
    J = rng.normal(size=(n, 2)) * np.exp(0.5 * rng.normal(size=(BANDS, 2)))[band]
    X = (0.8 * J[:, 0] + 0.6 * rng.normal(size=n))[:, None] * np.exp(0.5 * rng.normal(size=(BANDS, 1)))[band]
    r = rng.normal(size=n) - X[:, 0] * size + J[:, 1] * common * rng.normal(size=BANDS)[band]
    return LinearResponses(r, J, np.arange(n) % 4, band), X


def fitted(linear, X, out=None):
    kinds = LinearKinds([linear], np.eye(2) * 1e-8, np.zeros(2))
    return kinds.fitted({FREQUENCY: X}, np.array([1e3]), out)


@pytest.mark.parametrize("size", [0.3, 3.0, -30.0])
def test_an_effect_that_matters_is_not_the_noise_that_hides_it(size):
    step, covariance, fall = fitted(*responses(size))
    assert abs(step[2] - size) < 4.0 * np.sqrt(covariance[2, 2])
    assert np.sqrt(covariance[2, 2]) < 0.15
    assert fall > 20.0


def test_an_effect_that_is_not_there_is_insignificant():
    falls = [fitted(*responses(0.0, seed=seed))[2] for seed in range(20)]
    assert max(falls) < 16.0 and min(falls) >= -1e-9


def test_causes_that_lines_have_in_common_make_information_less():
    alone, shared = (responses(0.0, common)[0].equations(np.zeros((0, 0)))[0] for common in (0.0, 1.0))
    assert shared[1, 1] < 0.3 * alone[1, 1]


def test_a_fold_that_is_left_out_counts_nothing():
    linear, X = responses(2.0)
    kept = linear.fold_of != 1
    part = LinearResponses(linear.r[kept], linear.J[kept], linear.fold_of[kept], linear.band[kept])
    step, covariance, _ = fitted(linear, X, (FREQUENCY, 1))
    alone, other, _ = fitted(part, X[kept])
    # priors apart, these are the same rows
    np.testing.assert_allclose(step, alone, rtol=1e-9)
    np.testing.assert_allclose(covariance, other, rtol=1e-9)
