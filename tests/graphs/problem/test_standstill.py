# SPDX-License-Identifier: BSD-3-Clause
"""A joint that stands tells nothing by its equation of motion."""

import numpy as np

from jointscope.graphs.problem.standstill import near, slowest_speed


def test_dry_friction_is_a_sign_from_the_slowest_speed_on():
    v = np.full(100, 0.1)
    assert np.tanh(2000.0 * slowest_speed(v, 2000.0)) > 0.99
    assert slowest_speed(v, 1e9) == 1e-4


def test_a_mask_is_widened_on_both_sides():
    mask = np.zeros(9, dtype=bool)
    mask[4] = True
    np.testing.assert_array_equal(np.flatnonzero(near(mask, 2)), [2, 3, 4, 5, 6])
    np.testing.assert_array_equal(near(mask, 0), mask)
