# SPDX-License-Identifier: BSD-3-Clause
"""Where the estimator begins in the middle of a motion: velocities within their sigmas, and no wider than need be."""

from __future__ import annotations

import numpy as np
import pytest
from robots_to_compare import ROBOTS

from jointscope.graphs.fixed_lag.window.augmented_layout import AugmentedLayout
from jointscope.graphs.fixed_lag.window.first_state import ACCELERATION, EncoderSample, first_state

RIGID = ROBOTS["joint 2 rigid"]


def begun(times, motion, seed):
    encoder = RIGID.motor_encoder
    noise = encoder.sigmas * np.random.default_rng(seed).standard_normal((len(times), RIGID.n))
    q = motion(np.asarray(times)) + noise + np.asarray(encoder.zero)
    layout = AugmentedLayout(RIGID.layout, tuple(s.name for s in RIGID.biased), ())
    now, state = first_state(RIGID, layout, [EncoderSample(t, row) for t, row in zip(times, q, strict=True)], None)
    own = layout.robot
    return now, state.mean[own.motor_v], np.sqrt(np.diag(state.covariance)[own.motor_v])


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
def test_velocities_of_accelerating_joints_are_within_their_sigmas(rate):
    a, v0 = np.array([3.0, -1.0, 0.5]), np.array([0.1, 0.0, -0.4])
    times = np.arange(max(5, round(0.021 * rate) + 1)) / rate
    for seed in range(20):
        now, v, sigma = begun(times, lambda t: v0 * t[:, None] + 0.5 * a * t[:, None] ** 2, seed)
        assert np.abs((v - v0 - a * now) / sigma).max() < 3.5
        assert sigma.max() < 0.5 * ACCELERATION * now


def test_two_samples_leave_the_acceleration_open():
    now, _, sigma = begun([0.0, 0.3], lambda t: np.array([0.2, 0.1, 0.3]) * t[:, None], 0)
    assert np.all(sigma >= 0.5 * ACCELERATION * now)
