# SPDX-License-Identifier: BSD-3-Clause
"""The cost of a torque that dry friction holds, against the integral that defines it and against drawn torques."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from jointscope.factors.friction_band import band_cost, piled_cost


def test_the_cost_is_the_logarithm_of_a_blurred_band():
    half, sigma = 0.1, 0.02
    for y in (0.0, 0.05, 0.1, -0.13):
        density, _ = quad(
            lambda f, y=y: np.exp(-0.5 * ((y - f) / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi)) / (2.0 * half),
            -half, half, epsabs=1e-13,
        )  # fmt: skip
        found = band_cost(np.array([y]), np.array([half]), np.array([sigma])).cost[0]
        assert found == pytest.approx(-np.log(density * sigma * np.sqrt(2.0 * np.pi)), abs=1e-9)


def test_it_is_never_negative_and_far_outside_it_is_the_square_of_the_distance():
    y, half = np.array([0.0, 5.0, -5.0]), np.array([1e-6, 0.1, 0.1])
    found = band_cost(y, half, np.full(3, 0.01)).cost
    assert found[0] == pytest.approx(0.0, abs=1e-6) and np.all(found >= 0.0)
    np.testing.assert_allclose(found[1:], 0.5 * (4.9 / 0.01) ** 2, rtol=1e-3)


def test_gradients_are_those_of_differences():
    y = np.array([0.0, 0.05, 0.099, 0.101, -0.1, -0.12, 0.2])
    half, sigma, h = np.full(7, 0.1), np.full(7, 0.004), 1e-7
    found = band_cost(y, half, sigma)
    by_y = (band_cost(y + h, half, sigma).cost - band_cost(y - h, half, sigma).cost) / (2.0 * h)
    by_half = (band_cost(y, half + h, sigma).cost - band_cost(y, half - h, sigma).cost) / (2.0 * h)
    np.testing.assert_allclose(found.by_torque, by_y, rtol=1e-5, atol=1e-3)
    np.testing.assert_allclose(found.by_half, by_half, rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize("sigma", [0.002, 0.02, 0.3])
def test_information_is_the_variance_of_the_gradient(sigma):
    rng, n, half = np.random.default_rng(3), 200_000, 0.1
    y = rng.uniform(-half, half, n) + sigma * rng.normal(size=n)
    found = band_cost(y, np.full(n, half), np.full(n, sigma))
    assert abs(found.by_torque.mean()) < 4.0 * found.by_torque.std() / np.sqrt(n)
    assert abs(found.by_half.mean()) < 4.0 * found.by_half.std() / np.sqrt(n)
    assert found.torque_information[0] == pytest.approx(found.by_torque.var(), rel=0.05)
    assert found.half_information[0] == pytest.approx(found.by_half.var(), rel=0.05)


def test_curvature_is_that_of_differences_without_the_logarithm_of_half():
    y, h = np.array([0.0, 0.099, 0.101, -0.1, 0.2, 0.03]), 1e-6
    half, sigma = np.full(6, 0.1), np.array([0.004, 0.004, 0.004, 0.02, 0.004, 0.2])
    yy, yh, hh = band_cost(y, half, sigma).curvature
    up, down = (band_cost(y, half + side, sigma) for side in (h, -h))
    right, left = (band_cost(y + side, half, sigma) for side in (h, -h))
    np.testing.assert_allclose(hh, (up.by_half - down.by_half) / (2.0 * h) + 1.0 / half**2, rtol=1e-4, atol=1.0)
    np.testing.assert_allclose(yh, (up.by_torque - down.by_torque) / (2.0 * h), rtol=1e-4, atol=1.0)
    np.testing.assert_allclose(yy, (right.by_torque - left.by_torque) / (2.0 * h), rtol=1e-4, atol=1.0)


@pytest.mark.parametrize(("share", "depth"), [(0.0001, 0.1), (0.5, 0.1), (0.9, 0.02), (0.3, 0.5)])
def test_a_band_with_piles_is_a_density_and_without_piles_the_plain_one(share, depth):
    half, sigma = 0.1, 0.002
    y = np.linspace(-0.15, 0.15, 60_001)
    shares, depths = np.array([share]), np.array([depth])
    cost = piled_cost(y[None], np.full((1, len(y)), half), np.full(len(y), sigma), shares, depths)[0]
    density = np.exp(-cost) / (sigma * np.sqrt(2.0 * np.pi))
    assert np.trapezoid(density, y) == pytest.approx(1.0, abs=1e-4)
    near = np.abs(y) > half * (1.0 - depth)
    in_piles = share + (1.0 - share) * depth
    assert np.trapezoid(np.where(near, density, 0.0), y) == pytest.approx(
        in_piles, abs=0.06 * share / depth * 0.2 + 0.02
    )
    if share < 0.001:
        plain = band_cost(y, np.full(len(y), half), np.full(len(y), sigma)).cost
        inside = np.abs(y) < 0.1
        np.testing.assert_allclose(cost[inside], plain[inside], atol=2e-3)
