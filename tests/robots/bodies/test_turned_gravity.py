# SPDX-License-Identifier: BSD-3-Clause
"""Gravity of a base that is not level."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jointscope.robots.bodies.turned_gravity import level_axes, turned_gravity

UPRIGHT, SLANTED = np.array([0.0, 0.0, -9.81]), np.array([1.0, -2.0, -9.0])


@pytest.mark.parametrize("gravity", [UPRIGHT, SLANTED])
@pytest.mark.parametrize("angles", [(0.0, 0.0), (3e-5, -2e-5), (0.05, -0.3), (1.0, 0.4)])
def test_gravity_turns_as_a_rotation_vector_says_and_its_slopes_are_those_of_differences(gravity, angles):
    axes, angles = level_axes(gravity), np.array(angles)
    np.testing.assert_allclose(axes @ axes.T, np.eye(2), atol=1e-12)
    np.testing.assert_allclose(axes @ gravity, 0.0, atol=1e-12)
    turned, slopes = turned_gravity(gravity, angles)
    np.testing.assert_allclose(turned, Rotation.from_rotvec(angles @ axes).apply(gravity), atol=1e-12)
    for i, step in enumerate(1e-6 * np.eye(2)):
        ahead, behind = (turned_gravity(gravity, angles + sign * step)[0] for sign in (1, -1))
        np.testing.assert_allclose(slopes[i], (ahead - behind) / 2e-6, atol=1e-7)


def test_the_axes_of_an_upright_base_are_x_and_y():
    np.testing.assert_allclose(level_axes(UPRIGHT), np.eye(3)[:2])
