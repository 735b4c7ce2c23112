# SPDX-License-Identifier: BSD-3-Clause
"""A relay that repeats messages later is told as a second publisher; what repeats itself for other reasons is kept."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.late_copies import late_copies, without_late_copies

STEP = 20_000_000  # [ns]


def driver(n=400, seed=1):
    """Stamps and noisy values of two joints."""
    t = np.arange(n) * STEP / 1e9
    noise = 1e-5 * np.random.default_rng(seed).standard_normal((n, 2))
    return STEP * np.arange(n), np.column_stack([np.sin(3 * t), np.cos(5 * t)]) + noise


def with_relay(later, every, resting=0):
    """The driver's messages among those of a relay, and which are the relay's; the driver rests now and then."""
    stamps, values = driver()
    values[np.arange(len(values)) % 100 < resting] = 0.25
    repeated = np.flatnonzero(stamps + later < stamps[-1])[::every]
    both = np.concatenate([stamps, stamps[repeated] + later])
    order = np.argsort(both, kind="stable")
    samples = TimedSamples(both[order], both[order], np.vstack([values, values[repeated]])[order])
    return samples, order >= len(stamps)


@pytest.mark.parametrize("every", (1, 2, 7))
@pytest.mark.parametrize("later", (43_000_000, 61_000_000, 305_000_000))
def test_messages_of_a_relay_are_left_out_and_said(later, every):
    samples, is_relay = with_relay(later, every)
    kept, (notice,) = without_late_copies("command", samples)
    assert kept.stamps.tolist() == samples.stamps[~is_relay].tolist()
    assert notice.kind == "foreign" and notice.count == is_relay.sum()
    assert f"{is_relay.sum()} messages of a second node that repeats those of the driver" in notice.text


@pytest.mark.parametrize("resting", (10, 35, 70))
@pytest.mark.parametrize("later", (61_000_000, 305_000_000))
def test_a_relay_of_commands_that_rest_is_left_out_whole(later, resting):
    samples, is_relay = with_relay(later, 1, resting)
    kept, (notice,) = without_late_copies("command", samples)
    assert kept.stamps.tolist() == samples.stamps[~is_relay].tolist()
    assert notice.count == is_relay.sum()


def test_a_driver_alone_loses_nothing():
    stamps, values = driver()
    assert not late_copies(stamps, values).any()


@pytest.mark.parametrize("counts", (2 * np.pi / 4096, 1e-2, 0.2))
def test_coarse_encoders_repeat_themselves_by_chance(counts):
    stamps, values = driver()
    assert not late_copies(stamps, np.round(values / counts) * counts).any()


def test_periodic_commands_squares_rests_and_staircases_are_kept():
    stamps, values = driver()
    periodic = np.tile(values[:25], (16, 1))
    square = np.where(np.sin(2 * np.pi * 3 * stamps / 1e9)[:, None] > 0, 1.5, -1.5) * np.ones(2)
    rests = np.where((np.arange(400) % 100 < 50)[:, None], 0.25, values)
    staircase = np.repeat(values[:100], 4, axis=0)
    for kept in (periodic, square, rests, staircase, np.zeros((400, 2))):
        assert not late_copies(stamps, kept).any()


@pytest.mark.parametrize("resting", (20, 60, 150))
def test_rests_that_change_in_their_last_digits_are_kept(resting):
    """As a controller's command of three joints that hold still, to six digits."""
    rng, stamps = np.random.default_rng(3), STEP * np.arange(400)
    values = np.column_stack([np.sin(3 * stamps / 1e9), np.cos(5 * stamps / 1e9), np.sin(stamps / 1e9)])
    values[:resting] = values[0] + 1e-6 * rng.integers(0, 3, (resting, 3))
    assert not late_copies(stamps, values).any()


@pytest.mark.parametrize("digits", (1, 2, 3, 4))
def test_a_signal_that_turns_round_in_coarse_steps_is_the_drivers(digits):
    """Triangles and sines pass the same values on both sides of each turn."""
    rng, t = np.random.default_rng(digits), np.arange(800) / 100.0
    for _ in range(150):
        frequency, size, phase = rng.uniform(0.05, 3.0), rng.uniform(0.2, 6.0), rng.uniform(0.0, 6.0)
        sine = np.sin(2.0 * np.pi * frequency * t + phase)
        for shape in (sine, np.arcsin(sine)):
            values = np.round(size * shape, digits)[:, None]
            assert not late_copies(np.round(1e9 * t).astype(np.int64), values).any()
