# SPDX-License-Identifier: BSD-3-Clause
"""Ticks of the states."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.problem.timeline import LONGEST_STEP, Timeline
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Recording, Stream


def recording(period, n=200):
    times = period * np.arange(n)
    streams = {name: Stream(name, times, np.ones((n, 1)), (name,), "") for name in ("command", "motor_encoder")}
    return Recording("run.bag", "", 0, streams)


def test_steps_of_slow_commands_are_divided():
    timeline = Timeline.of(recording(0.1))
    assert np.all(timeline.h < 1.3 * LONGEST_STEP) and timeline.ticks[-1] == pytest.approx(19.9)


def test_samples_that_come_too_seldom_for_a_motion_are_refused_before_they_take_the_memory():
    with pytest.raises(RecordingError, match=r"400 samples in 1990 s are too few to follow a motion; expected several"):
        Timeline.of(recording(10.0))


def test_a_step_is_divided_at_a_time_but_not_beside_a_tick_by_a_rounding_error():
    whole = Timeline.of(recording(2e-3)).ticks
    between = np.array([-1.0, np.nextafter(whole[3], 1.0), whole[4] - 1e-7, 0.5 * (whole[5] + whole[6]), 9.0])
    np.testing.assert_array_equal(np.setdiff1d(Timeline.of(recording(2e-3), between=between).ticks, whole), between[3])
