# SPDX-License-Identifier: BSD-3-Clause
"""The compiled change from torques to accelerations against products of arrays."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.dynamics.follow_kernel import links_follow


@pytest.mark.parametrize(("n", "r", "d", "p"), [(3, 6, 12, 12), (6, 6, 12, 0), (1, 3, 5, 2)])
def test_rows_of_links_become_accelerations_and_all_others_stay(n, r, d, p):
    rng, m = np.random.default_rng(8), 4
    M_inverse, by_q, by_v = rng.normal(size=(3, m, n, n))
    by_state, by_parameter = rng.normal(size=(m, r, d)), rng.normal(size=(m, r, p))
    states, parameters = by_state.copy(), by_parameter.copy()
    states[:, :n], parameters[:, :n] = M_inverse @ by_state[:, :n], M_inverse @ by_parameter[:, :n]
    states[:, :n, :n] += by_q
    states[:, :n, n : 2 * n] += by_v
    links_follow(M_inverse, by_q, by_v, by_state, by_parameter)
    np.testing.assert_allclose(by_state, states, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(by_parameter, parameters, rtol=1e-12, atol=1e-13)
