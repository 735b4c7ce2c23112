# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.clocks.time_order import in_time_order
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.stream_notices import clipping_notices, step_notices, timing, timing_notices

MILLISECOND = 1_000_000


def samples(stamps):
    """Samples that carry their place in the bag as value."""
    stamps = np.asarray(stamps, dtype=np.int64)
    place = np.arange(len(stamps))
    return TimedSamples(stamps, 10**18 + place * MILLISECOND, place[:, None].astype(float))


def kinds(notices):
    return {notice.kind: notice.count for notice in notices}


def test_regular_samples_pass_unchanged():
    given = samples(np.arange(1000) * MILLISECOND)
    ordered, notices = in_time_order("imu1", given)
    assert np.array_equal(ordered.stamps, given.stamps) and notices == []


def test_samples_that_overtook_each_other_are_sorted_with_all_they_carry():
    stamps = np.arange(1000) * MILLISECOND
    stamps[[10, 11]] = stamps[[11, 10]]
    ordered, notices = in_time_order("imu1", samples(stamps))
    assert ordered.values[9:13, 0].tolist() == [9, 11, 10, 12]
    assert [notice.text for notice in notices] == [
        "imu1: 1 sample came out of order, at most 1 ms late; sorted by stamp"
    ]


def test_a_delayed_batch_is_sorted():
    place = np.r_[0:100, 130:160, 100:130, 160:1000]
    ordered, notices = in_time_order("imu1", samples(place * MILLISECOND))
    assert np.array_equal(ordered.stamps, np.arange(1000) * MILLISECOND)
    assert kinds(notices) == {"out_of_order": 30}


def test_of_samples_with_the_same_stamp_the_first_stays():
    stamps = np.r_[0:5, 4, 4, 5:1000] * MILLISECOND
    ordered, notices = in_time_order("imu1", samples(stamps))
    assert np.all(np.diff(ordered.stamps) > 0)
    assert ordered.values[4, 0] == 4
    assert [notice.text for notice in notices] == [
        "imu1: left out 2 samples with the stamp of the one before; the first of each stays"
    ]


@pytest.mark.parametrize("back", (700, 100))
def test_a_clock_that_is_set_back_is_refused(back):
    stamps = np.r_[0:1000, 1000 - back : 2000] * MILLISECOND
    with pytest.raises(RecordingError) as error:
        in_time_order("imu1", samples(stamps))
    assert str(error.value) == (
        f"imu1: the stamps go back by {'0.699 s' if back == 700 else '99 ms'} at message 1000 and do not recover, and "
        "the times of reception do not explain why; expected one clock without jumps: use the part before or after it, "
        "cut out with `ros2 bag convert` (start_time_ns, end_time_ns) or `rosbag filter`, or record again"
    )


def test_a_clock_that_goes_back_by_a_fraction_of_a_period_more_than_whole_ones_is_refused():
    stamps = np.r_[np.arange(1000), np.arange(950, 1500) + 0.4] * MILLISECOND
    with pytest.raises(RecordingError, match="the stamps go back by"):
        in_time_order("imu1", samples(stamps))


def test_a_clock_that_jumps_forward_is_refused():
    stamps = np.r_[0:5, 10**9 : 10**9 + 1000] * MILLISECOND
    with pytest.raises(RecordingError, match="the stamps jump forward by 12 days at message 5"):
        in_time_order("imu1", samples(stamps))


@pytest.mark.parametrize("seed", range(5))
def test_any_mixture_of_late_and_repeated_samples_ends_in_order(seed):
    rng = np.random.default_rng(seed)
    true = np.cumsum(rng.integers(500_000, 1_500_000, 2000))
    arrival = np.argsort(true + rng.uniform(0, 5e6, 2000), kind="stable")
    stamps = np.repeat(true[arrival], 1 + (rng.uniform(size=2000) < 0.02))
    ordered, notices = in_time_order("imu1", samples(stamps))
    assert np.array_equal(ordered.stamps, true)
    assert kinds(notices)["duplicate"] == len(stamps) - 2000


def test_gaps_are_counted_with_the_samples_that_are_missing():
    times = np.delete(np.arange(2000) / 1000, np.r_[100, 500:520])
    assert [notice.text for notice in timing_notices("imu1", times)] == [
        "imu1: 2 gaps, about 21 samples missing; the longest is 21 ms at 0.499 s"
    ]


def test_jitter_is_noted_and_is_no_gap():
    rng = np.random.default_rng(2)
    jitter = rng.uniform(-1, 1, 5000)
    times = np.sort(np.arange(5000) / 1000 + 4e-4 * jitter)
    seen = timing(times)
    assert seen.gaps == 0
    assert seen.jitter == pytest.approx(8e-4 / np.sqrt(6), rel=0.05)
    (notice,) = timing_notices("imu1", times)
    assert notice.text == "imu1: samples come every 999 us, give or take 328 us; each counts at its own stamp"
    assert timing_notices("imu1", np.arange(5000) / 1000 + 1e-4 * jitter) == []  # trifles are not worth a word
    assert timing_notices("imu1", np.delete(np.arange(5000) / 1000, 70)) == []


def test_a_regular_stream_has_nothing_to_note():
    assert timing_notices("imu1", np.arange(5000) / 1000) == []
    assert timing(np.array([0.0])).rate == 0.0


def test_clipping_is_noted_per_channel():
    times = np.arange(5000) / 1000
    wave = 5.0 * np.sin(2 * np.pi * times)
    values = np.column_stack([np.clip(wave, -4, 4), wave, np.maximum(wave, -4.5)])
    notices = clipping_notices("imu1", values, ("imu1.x", "imu1.y", "imu1.z"), "rad/s")
    assert [notice.kind for notice in notices] == ["clipping"]
    assert notices[0].text == (
        "imu1 stays at a limit while it moves (beyond it nothing is measured: those samples are too small): "
        "imu1.x at -4 rad/s in 1025 samples; "
        "imu1.x at 4 rad/s in 1025 samples; imu1.z at -4.5 rad/s in 715 samples"
    )


def test_the_small_end_of_a_command_is_no_limit():
    times = np.arange(5000) / 1000
    pulses = np.where(np.sin(20 * times) > 0, 0.15, -1e-4) * (times < 4) + 1e-9 * times
    notices = clipping_notices("command", np.round(pulses, 7)[:, None], ("joint1.command",), "1")
    assert not any("-0.0001" in notice.text for notice in notices)


def test_a_quantized_signal_that_turns_around_or_rests_does_not_clip():
    times = np.arange(5000) / 1000
    wave = np.round(np.where(times < 2.25, np.sin(2 * np.pi * times), 1.0), 3)
    assert clipping_notices("motor_encoder", wave[:, None], ("joint1.motor_position",), "rad") == []


def test_commands_in_coarse_steps_are_told():
    t = np.linspace(0.0, 9.0, 1800)
    wave = 20.0 * np.sin(3.0 * t) + 9.0 * np.sin(11.0 * t)
    names = ("fine", "cut", "cut_finely", "square")
    values = np.column_stack([wave, 1.5 * np.trunc(wave / 1.5), 0.1 * np.rint(wave / 0.1), 5.0 * np.sign(wave)])
    (notice,) = step_notices("command", values, tuple(f"{name}.command" for name in names), "N m")
    assert notice.kind == "coarse" and notice.count == 1
    assert notice.text.startswith("command: cut.command in steps of 1.5 N m, 10 % of its rms")
    assert step_notices("command", values[:, [0]], ("fine.command",), "N m") == []
