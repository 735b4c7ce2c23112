# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from jointscope.robots.recordings.recording import Recording, Stream


def zeros(times, unit):
    return Stream("zeros", times, np.zeros((len(times), 1)), ("joint",), unit)


@pytest.fixture
def whole():
    return Recording("bag", "1f", 0, {"command": zeros(np.arange(0.0, 10.0, 0.01), "N m")}, [])


def test_the_last_part_of_a_recording_shares_no_sample_with_the_first(whole):
    assert not whole.between(7.0, np.inf).shares_samples_with(whole.between(-np.inf, 7.0))


def test_parts_that_overlap_share_samples(whole):
    assert whole.between(6.0, np.inf).shares_samples_with(whole.between(-np.inf, 7.0))
    assert whole.shares_samples_with(whole.between(2.0, 3.0))


def test_recordings_of_other_bags_share_none_at_any_time(whole):
    assert not whole.shares_samples_with(dataclasses.replace(whole, sha256="2e"))


def test_a_stream_that_ends_early_has_no_say_in_the_span(whole):
    early = zeros(np.array([0.0, 1.0]), "rad/s")
    part = dataclasses.replace(whole, streams={**whole.streams, "gyro": early}).between(5.0, np.inf)
    assert part.span == pytest.approx((5.0, 9.99))
