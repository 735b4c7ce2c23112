# SPDX-License-Identifier: BSD-3-Clause
"""Noise of sensors is told from motion at every rate, and is never nothing."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.tools.init.streams.sensor_noise import guess_noise


def moved(rate, seconds=10.0, jitter=0.0, seed=0):
    """A multi-sine up to 3 Hz, and its times, which may be irregular."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, seconds, 1.0 / rate)
    times = times + rng.uniform(-jitter, jitter, len(times)) / rate
    parts = [(0.1, 0.3), (0.3, 0.15), (1.1, 0.1), (1.9, 0.06), (3.1, 0.05)]
    return times, sum(a * np.sin(2.0 * np.pi * f * times + rng.uniform(0.0, 6.0)) for f, a in parts)


@pytest.mark.parametrize("rate", [50.0, 100.0, 250.0, 1000.0])
@pytest.mark.parametrize("sigma", [1e-5, 1e-3])
@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_noise_is_found_at_every_rate(rate, sigma, jitter):
    times, q = moved(rate, jitter=jitter)
    noisy = q + sigma * np.random.default_rng(1).standard_normal(len(q))
    assert guess_noise(times, noisy[:, None], "rad").sigma == pytest.approx(sigma, rel=0.25)


@pytest.mark.parametrize("rate", [50.0, 100.0, 500.0])
def test_a_coarse_encoder_has_the_noise_of_its_step(rate):
    times, q = moved(rate)
    step = 2.0 * np.pi / 4096
    found = guess_noise(times, step * np.rint(q[:, None] / step), "rad")
    assert found.sigma == pytest.approx(step / np.sqrt(12.0), rel=0.01) and "steps of" in found.reason


def test_without_any_noise_a_floor_is_taken_and_said():
    times, q = moved(200.0)
    found = guess_noise(times, q[:, None], "rad")
    assert found.sigma == pytest.approx(1e-6 * np.ptp(q)) and "one millionth of the range" in found.reason
    repeated = guess_noise(times, np.repeat(q[::4], 4)[: len(q), None], "rad")
    assert 1e-7 < repeated.sigma < 1e-2
    far = guess_noise(times, (100.0 + q[:, None]).astype(np.float32).astype(float), "rad")
    assert 2e-6 < far.sigma < 1e-5
