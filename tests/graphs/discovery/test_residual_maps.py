# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.discovery.missing_torque import MissingTorque
from jointscope.graphs.discovery.residual_maps import BINS, FEWEST, residual_maps


def missing_of(torque, q=None, v=None, explained=None):
    """One joint; the torque is that of its motor."""
    m = len(torque)
    rng = np.random.default_rng(3)
    zeros, t = np.zeros((m, 1)), np.arange(m) * 1e-3
    q = zeros if q is None else q[:, None]
    v = zeros if v is None else v[:, None]
    both = np.column_stack([0.1 * rng.normal(size=m), torque])
    curves = {} if explained is None else {"friction@joint1": np.column_stack([np.zeros(m), explained])}
    return MissingTorque(("joint1",), ("joint1.link", "joint1.motor"), t, both, np.full_like(both, 0.1), q, v, q, v,
                         zeros, zeros, curves)  # fmt: skip


def motion(m=8000, seed=1):
    """A position and its velocity, several frequencies."""
    t = np.arange(m) * 1e-3
    phases = np.random.default_rng(seed).uniform(0.0, 6.0, 4)
    rates = 2 * np.pi * np.array([0.37, 0.81, 1.7, 2.9])
    return np.sin(rates * t[:, None] + phases).sum(1), (rates * np.cos(rates * t[:, None] + phases)).sum(1)


def test_the_signal_that_drives_the_torque_comes_first_and_its_shape_is_found():
    q, v = motion()
    torque = 1.3 * np.tanh(2.0 * v) + 0.05 * np.random.default_rng(2).normal(size=len(v))
    first = residual_maps(missing_of(torque, q, v, 1.3 * np.tanh(2.0 * v)))[0]
    assert (first.row, first.signal, first.unit, first.own) == ("joint1.motor", "joint1.velocity", "rad/s", True)
    assert first.telling > 0.4
    fast = np.abs(first.centers) > 2.0
    np.testing.assert_allclose(first.median[fast], 1.3 * np.sign(first.centers[fast]), atol=0.05)
    np.testing.assert_allclose(first.explained["friction@joint1"], first.median, atol=0.05)
    assert np.all(first.low <= first.median) and np.all(first.median <= first.high)


def test_a_smooth_torque_that_has_nothing_to_do_with_the_motion_tells_nothing():
    q, v = motion()
    other, _ = motion(seed=9)
    maps = residual_maps(missing_of(np.roll(other, 1234), q, v))
    assert all(m.telling < 0.15 for m in maps)


def test_every_bin_holds_enough_samples_and_there_are_not_too_many():
    q, v = motion(600)
    for m in residual_maps(missing_of(v, q, v)):
        assert 3 <= len(m.centers) <= BINS
        assert len(m.centers) * FEWEST <= 600
        assert np.all(np.isfinite([m.low, m.median, m.high]))


@pytest.mark.parametrize("count", [0, 5, 200])
def test_a_robot_that_stands_still_or_a_short_recording_has_no_maps(count):
    assert residual_maps(missing_of(np.zeros(count))) == []


def test_a_long_recording_takes_no_longer_than_its_thinned_copy():
    q, v = motion(100_000)
    whole, thinned = residual_maps(missing_of(v, q, v)), residual_maps(missing_of(v[::5], q[::5], v[::5]))
    by_name = {(m.row, m.signal): m for m in thinned}
    best = whole[0]
    np.testing.assert_allclose(best.median, by_name[best.row, best.signal].median, rtol=1e-9)
