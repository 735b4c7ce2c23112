# SPDX-License-Identifier: BSD-3-Clause
"""The middle of a swing is where the link comes to rest, with a sigma that holds, however coarse its encoder."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jointscope.robots.rests import swing as swing_module
from jointscope.robots.rests.swing import middle_of_swing, readings_alike, swing

T = np.arange(0.0, 2.0, 0.01)
STEP = 1.5e-3  # [rad]
SIGMA = STEP / np.sqrt(12.0)


def rounded(q):
    return STEP * np.round(q / STEP)


def decaying(rng, size):
    """A swing about somewhere between two steps."""
    middle, phase = rng.uniform(0.1, 0.2), rng.uniform(0.0, 2.0 * np.pi)
    wave = size * np.exp(-rng.uniform(0.2, 1.0) * T) * np.cos(2.0 * np.pi * rng.uniform(0.7, 3.0) * T + phase)
    return middle, middle + wave


def test_a_swing_over_some_steps_tells_its_middle_better_than_a_step():
    rng, off, sigmas, plain = np.random.default_rng(1), [], [], []
    for _ in range(60):
        middle, q = decaying(rng, 8.0 * STEP)
        found = middle_of_swing(T, rounded(q), SIGMA)
        off.append(found.value - middle)
        sigmas.append(found.sigma)
        plain.append(rounded(q[-100:]).mean() - middle)
    z = np.array(off) / sigmas
    assert 0.3 < np.sqrt(np.mean(z**2)) < 1.3 and np.mean(np.abs(z) < 2.0) > 0.9
    assert np.median(sigmas) < 0.4 * SIGMA
    assert np.std(off) < 0.2 * np.std(plain)


def test_two_modes_are_told_where_samples_show_them():
    rng, z = np.random.default_rng(2), []
    for _ in range(30):
        middle, q = decaying(rng, 8.0 * STEP)
        q = q + 3.0 * STEP * np.exp(-T) * np.cos(2.0 * np.pi * rng.uniform(5.0, 7.0) * T)
        found = middle_of_swing(T, rounded(q), SIGMA)
        z.append((found.value - middle) / found.sigma)
        assert found.sigma < SIGMA
    assert np.sqrt(np.mean(np.square(z))) < 1.5


def test_the_middle_of_a_swing_on_a_hardening_spring_is_not_taken_for_its_rest():
    # a spring of 40 (d - 2 d^2) N m/rad: the middle of a swing of 20 mrad lies 0.4 mrad beside
    def slopes(_, state):
        d, v = state
        return [v, (-40.0 * (d - 2.0 * d**2) - 0.1 * v) / 0.2]

    z = []
    for k, rest in enumerate(np.linspace(0.1, 0.1 + STEP, 12)):
        d = solve_ivp(slopes, (0.0, 2.0), [0.02 + 1e-4 * k, 0.0], t_eval=T, rtol=1e-9, atol=1e-12).y[0]
        found = middle_of_swing(T, rounded(rest + d), SIGMA)
        z.append((found.value - rest) / found.sigma)
    assert np.max(np.abs(z)) < 3.0 and np.sqrt(np.mean(np.square(z))) < 1.5


def test_what_stands_or_drifts_shows_no_swing():
    assert middle_of_swing(T, rounded(0.1 + 0.0 * T), SIGMA) is None
    assert middle_of_swing(T, rounded(0.1 + 0.4 * STEP * np.cos(3.0 * T)), SIGMA) is None
    noise = SIGMA * np.random.default_rng(3).normal(size=len(T))
    assert middle_of_swing(T, 0.1 + noise, SIGMA) is None


def test_an_encoder_without_steps_repeats_no_better_than_its_sigma():
    noise = SIGMA * np.random.default_rng(4).normal(size=len(T))
    found = middle_of_swing(T, 0.1 + 8.0 * STEP * np.exp(-0.3 * T) * np.cos(9.0 * T) + noise, SIGMA)
    assert SIGMA < found.sigma < 1.2 * SIGMA and found.value == pytest.approx(0.1, abs=3.0 * SIGMA)


def test_samples_alike_in_a_row_are_counted():
    np.testing.assert_array_equal(readings_alike(np.array([1.0, 1.0, 2.0, 1.0, 1.0, 1.0])), [2, 2, 1, 3, 3, 3])


def test_slopes_of_a_swing_are_those_of_differences():
    t, values = T - T[-1], np.array([0.1, 1.5, 0.01, -0.02, 9.0, 0.3, 0.004, 0.003, 20.0, 0.8])
    J = swing(t, values)[1]
    for i, value in enumerate(values):
        h = 1e-6 * max(abs(value), 1e-2) * np.eye(len(values))[i]
        slope = (swing(t, values + h)[0] - swing(t, values - h)[0]) / (2.0 * h[i])
        np.testing.assert_allclose(J[:, i], slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max())


def test_frequencies_that_are_tried_find_what_the_whole_grid_finds(monkeypatch):
    """The slow reference: every frequency that the readings can show."""

    def every(t, weighted, highest):
        length = -float(t[0])
        return 2.0 * np.pi * np.arange(swing_module.LOWEST / length, highest, swing_module.FINEST / length)

    t, rng = np.arange(800) / 400.0, np.random.default_rng(5)
    for slow, fast in ((3.0, 41.0), (9.0, 150.0), (14.0, 24.0)):
        d = 0.004 * np.exp(-0.7 * t) * np.cos(slow * t) + 0.001 * np.exp(-0.3 * t) * np.sin(fast * t)
        readings = 0.2 + d + 2e-5 * rng.normal(size=len(t))
        chosen = middle_of_swing(t, readings, 2e-5)
        with monkeypatch.context() as patch:
            patch.setattr(swing_module, "_promising", every)
            whole = middle_of_swing(t, readings, 2e-5)
        assert abs(chosen.value - whole.value) < 0.01 * whole.sigma
        assert abs(chosen.value - 0.2) < 4.0 * chosen.sigma
