# SPDX-License-Identifier: BSD-3-Clause
"""Stretches of a recording that are left out."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Recording, Stream


@pytest.fixture
def recording():
    """Ten seconds."""
    times = np.arange(0.0, 10.0, 0.01)
    command = Stream("command", times, np.ones((len(times), 1)), ("joint1.command",), "1")
    return Recording("run.mcap", "", 0, {"command": command})


def test_predictions_through_a_stretch_are_not_judged(recording):
    without = recording.leaving_out([(4.0, 5.0)])
    times = np.array([3.9, 4.0, 4.5, 5.0, 5.05, 5.2])
    assert without.are_judged(times).tolist() == [True, False, False, False, True, True]
    assert without.are_judged(times, 0.1).tolist() == [True, False, False, False, False, True]
    assert recording.are_judged(times, 0.1).all()


def test_parts_and_further_stretches_keep_what_was_left_out(recording):
    without = recording.leaving_out([(4.0, 5.0)]).between(2.0, 8.0).leaving_out([(6.0, 6.5)])
    assert without.left_out == ((4.0, 5.0), (6.0, 6.5))


@pytest.mark.parametrize("stretch", [(5.0, 4.0), (3.0, 3.0), (11.0, 12.0), (-2.0, -1.0), (float("nan"), 2.0)])
def test_impossible_stretches_are_refused(recording, stretch):
    with pytest.raises(RecordingError, match=r"run\.mcap: cannot leave out .* expected a beginning before its end"):
        recording.leaving_out([stretch])


def test_something_must_be_left(recording):
    with pytest.raises(RecordingError, match="only 10 % would be left"):
        recording.leaving_out([(0.5, 5.0), (4.0, 9.5)])
