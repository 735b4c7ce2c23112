# SPDX-License-Identifier: BSD-3-Clause
"""Held commands that a second node repeats: the old level that comes back after a change is left out, nothing else."""

import numpy as np
import pytest

from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.late_copies import without_late_copies
from jointscope.tools.bags.tidying.stale_levels import stale_levels

RATE, SECONDS = 100.0, 8.0


def smooth(t):
    return 5.5 * np.sin(2.8 * t) + 3.0 * np.sin(8.2 * t + 1.0) + 1.5 * np.sin(17.0 * t + 2.0)


def held(rate):
    """A command with `rate` levels a second, stamped with 0.1 ms of jitter: times [s] and values."""
    t = np.arange(int(RATE * SECONDS)) / RATE
    return t + 1e-4 * np.random.default_rng(1).uniform(-1.0, 1.0, len(t)), smooth(np.floor(t * rate) / rate)


def repeated(t, u, late, every=1, jitter=0.0):
    """With a node that sends each `every`-th message again: stamps, values, which are its, which are stale."""
    own = np.arange(0, len(t), every)
    at = t[own] + late + jitter * np.random.default_rng(2).uniform(-1.0, 1.0, len(own))
    order = np.argsort(np.concatenate([t, at]))
    values = np.concatenate([u, u[own]])[order]
    copies = np.concatenate([np.zeros(len(t), bool), np.ones(len(own), bool)])[order]
    stamps = np.round(np.concatenate([t, at])[order] * 1e9).astype(np.int64)
    driver = np.maximum.accumulate(np.where(copies, 0, np.arange(len(values))))
    return stamps, values[:, None], copies, copies & (values != values[driver])


@pytest.mark.parametrize(
    ("levels", "late", "every", "jitter"),
    [
        (4, 0.0603, 1, 0.0),
        (4, 0.0603, 2, 0.0),
        (4, 0.035, 3, 0.0),
        (8, 0.045, 1, 0.0),
        (5, 0.0203, 1, 0.0),
        (3, 0.12, 1, 0.0),
        (4, 0.06, 1, 0.008),
    ],
)
def test_every_old_level_is_left_out_and_no_message_of_the_driver(levels, late, every, jitter):
    stamps, values, copies, stale = repeated(*held(levels), late, every, jitter)
    found, usual = stale_levels(stamps, values)
    assert np.count_nonzero(stale) > 20
    assert not np.any(stale & ~found) and not np.any(found & ~copies)
    assert late - every / RATE < usual < late + every / RATE


def test_the_note_says_that_a_second_node_repeats_the_driver():
    stamps, values, _, stale = repeated(*held(4), 0.0603)
    kept, (notice,) = without_late_copies("command", TimedSamples(stamps, stamps, values))
    assert len(kept.stamps) == len(stamps) - np.count_nonzero(stale) and notice.kind == "foreign"
    assert "second node" in notice.text and "after it has sent another" in notice.text


def trembling(t, rng):
    return np.round(2.0 * np.sin(1.7 * t) + 0.3 * rng.standard_normal(len(t)), 0)


def telegraph(t, rng):
    return np.cumsum(rng.random(len(t)) < 0.1) % 3 * 2.0


def triangle(t, rng):
    return np.round(4.0 * np.abs(2.0 * ((9.7 * t) % 1.0) - 1.0), 1)


def square(t, rng):
    return 3.0 * np.sign(np.sin(4.0 * t))


@pytest.mark.parametrize("signal", [trembling, telegraph, triangle, square, lambda t, rng: held(4)[1]])
@pytest.mark.parametrize("seed", range(5))
def test_one_driver_alone_loses_nothing(signal, seed):
    t = np.arange(int(RATE * SECONDS)) / RATE
    values = signal(t, np.random.default_rng(seed))[:, None]
    assert not np.any(stale_levels(np.round(t * 1e9).astype(np.int64), values)[0])
