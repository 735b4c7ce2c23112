# SPDX-License-Identifier: BSD-3-Clause
"""Long holes in all streams are made short; both sides stay as they are."""

from __future__ import annotations

import dataclasses

import numpy as np

from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.clocks.time_order import in_time_order
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.silences import with_silences_left_out
from jointscope.tools.bags.tidying.long_holes import LongHoles, with_short_holes

HOUR = 3600.0


def stream(name, times):
    return Stream(name, times, np.zeros((len(times), 1)), (name,), "")


def interrupted(seconds, period=0.01, offset=0.003, n=200):
    """Two streams with a hole of all in the middle."""
    times = period * np.arange(n) + np.where(np.arange(n) < n // 2, 0.0, seconds - period)
    return Recording("run.bag", "", 0, {"command": stream("command", times), "motor": stream("motor", times + offset)})


def test_a_long_hole_becomes_a_second_and_every_stream_keeps_its_place():
    recording = with_short_holes(interrupted(10 * HOUR))
    command, motor = recording.streams["command"].times, recording.streams["motor"].times
    np.testing.assert_allclose(motor - command, 0.003, atol=1e-9)
    steps = np.diff(command)
    np.testing.assert_allclose(np.delete(steps, 99), 0.01, atol=1e-9)
    assert abs(steps[99] - 1.003) < 1e-6  # the hole of all begins with the last sample of the other stream
    assert recording.notices[0].text == (
        "nothing at all was recorded for 10 h 0 min after 0.993 s; 1 s of it is kept, all later times are earlier by "
        "the rest, and both sides are used"
    )


def test_the_hole_is_left_out_and_both_sides_are_used():
    for seconds, kept in ((3.0, 3.0), (HOUR, 1.0)):  # most of the time, but no sample
        recording = with_silences_left_out(with_short_holes(interrupted(seconds)), "motor")
        (hole,) = recording.left_out
        assert abs(hole[0] - 0.99) < 1e-6 and abs(hole[1] - hole[0] - kept) < 0.02
        assert recording.are_judged(recording.command.times).mean() > 0.95


def test_what_was_left_out_moves_with_the_samples():
    recording = dataclasses.replace(interrupted(HOUR), left_out=((0.2, 0.3), (HOUR + 1.2, HOUR + 1.3)))
    first, second = with_short_holes(recording).left_out
    assert first == (0.2, 0.3)
    np.testing.assert_allclose(second, [2.203, 2.303], atol=1e-6)


def test_short_holes_seldom_samples_and_streams_of_different_times_stay():
    assert with_short_holes(short := interrupted(4.0)) is short
    seldom = 10.0 * np.arange(20.0)
    assert not len(LongHoles.of([seldom, seldom + 1.0]))
    apart = np.arange(100) / 100
    assert not len(LongHoles.of([apart, apart + HOUR]))
    assert not len(LongHoles.of([apart, np.empty(0)])) and not len(LongHoles.of([]))


def test_a_pause_that_the_times_of_reception_show_is_no_clock_that_was_set():
    stamps = 1_700_000_000_000_000_000 + np.rint(1e9 * interrupted(3 * HOUR).command.times).astype(np.int64)
    kept, notices = in_time_order("motor", TimedSamples(stamps, stamps + 1000, np.zeros((200, 1))))
    assert len(kept) == 200 and not notices
