# SPDX-License-Identifier: BSD-3-Clause
"""Alarms come where innovations are too large or refused, and only there."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.fixed_lag.messages.consistency import Consistency
from jointscope.graphs.fixed_lag.window.innovation import Innovation

NAMES = ("imu1.x", "imu1.y", "imu1.z")


def sample(t, z, channels=NAMES, used=True):
    """An innovation with normalised residuals z."""
    z = np.asarray(z, float)
    return Innovation("imu1", t, channels, 2e-3 * z, np.full(len(z), 2e-3), float(z @ z), len(z), used)


def fed(innovations):
    found = Consistency()
    return found, [change for innovation in innovations for change in found.add([innovation])]


def noise(seconds, scale, seed=1, begin=0.0):
    rng = np.random.default_rng(seed)
    return [sample(begin + 1e-3 * k, scale * rng.normal(size=3)) for k in range(round(1e3 * seconds))]


def test_right_noise_raises_no_alarm_and_has_mean_one():
    found, changes = fed(noise(10.0, 1.0))
    assert not changes and not found.alarms
    assert abs(found.nis_mean - 1.0) < 0.1 and all(abs(mean - 1.0) < 0.2 for mean in found.mean_square.values())


def test_noise_that_is_twice_as_large_raises_an_alarm_that_ends_with_it():
    found, changes = fed(noise(3.0, np.array([1.0, 2.0, 1.0])) + noise(5.0, 1.0, begin=3.0))
    assert [(name, begins) for name, _, begins in changes] == [("imu1.y", True), ("imu1.y", False)]
    assert not found.alarms


def test_a_glitch_is_no_alarm_but_one_refused_sample_in_ten_is():
    some = noise(3.0, 1.0)
    some[1500] = sample(1.5, [0.0, 80.0, 0.0], used=False)
    assert not fed(some)[0].alarms
    for k in range(0, len(some), 10):
        some[k] = sample(1e-3 * k, [0.0, 80.0, 0.0], used=False)
    assert set(fed(some)[0].alarms) == {"imu1.y"}


def test_channels_that_are_seldom_alone_raise_no_alarm_of_their_own():
    """Every 2 s one channel is missing."""
    rng = np.random.default_rng(3)
    found = Consistency()
    changes = []
    for k in range(30000):
        t, z = 5e-3 * k, rng.normal(size=3)
        changes += found.add([sample(t, z[:2], NAMES[:2]) if k % 400 == 0 else sample(t, z)])
    assert not changes
