# SPDX-License-Identifier: BSD-3-Clause
"""The test of two kinds on linear measurements that are drawn."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.frequency.agreement import agreement


def told(H, true, rng):
    """Posterior mean and information from measurements with unit noise, prior N(0, 1)."""
    A = H.T @ H
    return np.linalg.solve(np.eye(len(true)) + A, H.T @ (H @ true + rng.standard_normal(len(H)))), A


def test_kinds_of_one_arm_have_the_chi_square_of_their_shared_directions():
    rng, found = np.random.default_rng(1), []
    H1, H2 = np.diag([9.0, 5.0, 4.0, 0.0, 3.0]), np.diag([7.0, 0.0, 6.0, 8.0, 5.0])
    for _ in range(2000):
        true = rng.standard_normal(5)
        found.append(agreement(told(H1, true, rng), told(H2, true, rng)))
    assert {one.dof for one in found} == {3}
    assert abs(np.mean([one.chi2 for one in found]) - 3.0) < 0.2
    assert abs(np.mean([one.p_value < 0.05 for one in found]) - 0.05) < 0.02


def test_a_value_that_is_another_one_in_the_second_kind_is_told():
    rng, H, true = np.random.default_rng(2), 10.0 * np.eye(4), np.zeros(4)
    assert agreement(told(H, true, rng), told(H, true + np.eye(4)[0], rng)).doubtful


def test_kinds_that_share_nothing_agree():
    rng, true = np.random.default_rng(3), np.zeros(2)
    found = agreement(told(np.diag([9.0, 0.0]), true, rng), told(np.diag([0.0, 9.0]), true, rng))
    assert found.dof == 0 and found.p_value == 1.0
