# SPDX-License-Identifier: BSD-3-Clause
"""Rotations against those of pinocchio, one by one, and derivatives against differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from jointscope.robots.geometry.rotations import (
    log_slopes,
    mean_rotation,
    of_quaternions,
    of_roll_pitch_yaw,
    quaternion_xyzw,
    roll_pitch_yaw,
    rotation_vectors,
    spread,
)


@pytest.fixture
def vectors():
    """Some of any size up to half a turn, tiny ones and none at all."""
    rng = np.random.default_rng(2)
    sizes = np.concatenate([rng.uniform(0.0, 3.1, 30), 10.0 ** rng.uniform(-12.0, -3.0, 30), [0.0]])
    directions = rng.standard_normal((len(sizes), 3))
    return sizes[:, None] * directions / np.linalg.norm(directions, axis=1)[:, None]


def test_rotation_vectors_are_the_inverse_of_the_exponential(vectors):
    R = np.array([pin.exp3(v) for v in vectors])
    np.testing.assert_allclose(rotation_vectors(R), vectors, atol=1e-12)


def test_slopes_of_the_logarithm_are_those_of_differences(vectors):
    step = 1e-6
    for r, J in zip(vectors, log_slopes(vectors), strict=True):
        ends = [[pin.log3(pin.exp3(sign * step * axis) @ pin.exp3(r)) for axis in np.eye(3)] for sign in (1.0, -1.0)]
        np.testing.assert_allclose(J, (np.array(ends[0]) - ends[1]).T / (2.0 * step), atol=2e-7)


def test_quaternions_and_angles_are_those_of_pinocchio(vectors):
    R = np.array([pin.exp3(v) for v in vectors])
    xyzw = np.array([quaternion_xyzw(one) for one in R])
    np.testing.assert_allclose(of_quaternions(xyzw), R, atol=1e-14)
    np.testing.assert_allclose(of_quaternions(-xyzw), R, atol=1e-14)
    quarter = of_quaternions(np.array([[0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]]))[0]
    np.testing.assert_allclose(quarter @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(of_roll_pitch_yaw(*roll_pitch_yaw(R[3])), R[3], atol=1e-14)


def test_the_mean_of_rotations_is_where_noise_is_around_it():
    rng, R = np.random.default_rng(3), pin.exp3(np.array([0.3, -2.0, 1.0]))
    noisy = np.array([R @ pin.exp3(0.02 * rng.standard_normal(3)) for _ in range(4000)])
    assert np.linalg.norm(rotation_vectors((R.T @ mean_rotation(noisy))[None])) < 2e-3
    assert spread(noisy) == pytest.approx(0.02 * np.sqrt(3.0), rel=0.03)
