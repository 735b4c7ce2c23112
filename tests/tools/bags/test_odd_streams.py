# SPDX-License-Identifier: BSD-3-Clause
"""Streams as drivers make them: each fault is told by its own sign, left out or mended, and said; motion is kept."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.clocks.clock_steps import on_one_clock
from jointscope.tools.bags.clocks.durations import duration
from jointscope.tools.bags.clocks.time_order import in_time_order
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.clocks.two_clocks import brought_together
from jointscope.tools.bags.clocks.unfilled_stamps import without_unfilled
from jointscope.tools.bags.silences import with_silences_left_out
from jointscope.tools.bags.tidying.glitches import without_glitches
from jointscope.tools.bags.tidying.not_finite import without_gibberish
from jointscope.tools.bags.tidying.second_publisher import without_second_publisher
from jointscope.tools.bags.tidying.staircase import without_repetitions
from jointscope.tools.bags.tidying.tidy_samples import ordered_samples, plausible_samples

PERIOD = 2_000_000  # [ns]
START = 1_700_000_000_000_000_000
CHANNELS = ("a.motor_position", "b.motor_position")


def motion(n=1500, seed=1, counts=0.0, hz=2.0):
    """Two joints that swing, with noise, and pause for a while; received with a jitter."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) * PERIOD / 1e9
    angles = np.column_stack([np.sin(2 * np.pi * hz * t), 0.5 * np.cos(2 * np.pi * 0.6 * hz * t)])
    angles[600:750] = angles[600]
    values = angles + rng.normal(scale=1e-5, size=angles.shape)
    if counts:
        values = np.round(values / counts) * counts
    stamps = START + PERIOD * np.arange(n)
    return TimedSamples(stamps, stamps + rng.integers(200_000, 400_000, n), values)


def loses_nothing(samples):
    """Whatever looks for faults of streams finds none."""
    for step in (without_second_publisher, without_glitches):
        kept, notices = step("motor_encoder", CHANNELS, samples)
        assert len(kept) == len(samples) and not notices
    kept, notices = without_repetitions("motor_encoder", samples)
    assert len(kept) == len(samples) and not notices


@pytest.mark.parametrize("counts", (0.0, 2 * np.pi / 4096, 1e-2), ids=("fine", "4096 counts", "coarse"))
@pytest.mark.parametrize("seed", range(3))
def test_true_motion_loses_nothing(counts, seed):
    samples = motion(seed=seed, counts=counts)
    loses_nothing(samples)


def test_impacts_reversals_and_bounces_are_no_glitches():
    t = np.arange(2000) * 1e-3
    bouncing = np.abs(np.sin(2 * np.pi * 7 * t)) + 1e-6 * np.sin(1e3 * t)
    square = np.sign(np.sin(2 * np.pi * 3 * t + 0.1)) * (1 + 1e-6 * t)
    samples = TimedSamples(START + 1_000_000 * np.arange(2000), np.arange(2000), np.column_stack([bouncing, square]))
    assert len(without_glitches("imu1", CHANNELS, samples)[0]) == 2000


@pytest.mark.parametrize("length", (1, 2, 3))
@pytest.mark.parametrize("at", (0, 5, 400, 700))
def test_wild_samples_are_left_out_and_their_place_is_said(length, at):
    samples = motion()
    values = samples.values.copy()
    values[at : at + (length if at else 1), 1] += 0.3
    kept, (notice,) = without_glitches("motor_encoder", CHANNELS, dataclasses.replace(samples, values=values))
    expected = np.delete(samples.stamps, range(at, at + (length if at else 1)))
    assert kept.stamps.tolist() == expected.tolist()
    assert f"at {at * 2e-3:.3f}" in notice.text and "b.motor_position reads" in notice.text


def test_more_than_a_handful_of_wild_samples_is_refused_with_numbers():
    samples = motion()
    values = samples.values.copy()
    values[20:1400:60, 0] += np.linspace(1.0, 2.0, 23)
    with pytest.raises(RecordingError, match=r"a.motor_position: 23 of 1500 samples .* expected at most 7"):
        without_glitches("motor_encoder", CHANNELS, dataclasses.replace(samples, values=values))


def test_a_counter_that_begins_anew_is_no_glitch_and_a_glitch_in_it_is_found():
    samples = motion(hz=0.3)
    turns = np.mod(3.0 * samples.values, 1.0)
    wrapped = dataclasses.replace(samples, values=turns)
    assert len(without_glitches("motor_encoder", CHANNELS, wrapped, period=1.0)[0]) == len(samples)
    turns = turns.copy()
    turns[900, 0] = np.mod(turns[900, 0] + 0.3, 1.0)
    kept, _ = without_glitches("motor_encoder", CHANNELS, dataclasses.replace(samples, values=turns), period=1.0)
    assert kept.stamps.tolist() == np.delete(samples.stamps, 900).tolist()


@pytest.mark.parametrize("every", (5, 17, 60))
@pytest.mark.parametrize("constant", ((0.0, 0.0), (3.0, -2.0)))
def test_a_second_node_that_repeats_itself_is_recognised(every, constant):
    samples = motion()
    at = np.arange(3, 1500, every)
    mixed = TimedSamples(
        np.insert(samples.stamps, at, samples.stamps[at] - PERIOD // 3),
        np.insert(samples.received, at, samples.received[at]),
        np.insert(samples.values, at, constant, axis=0),
    )
    kept, (notice,) = without_second_publisher("motor_encoder", CHANNELS, mixed)
    assert kept.values.tobytes() == samples.values.tobytes()
    assert notice.text.startswith(f"motor_encoder: left out {len(at)} messages of a second node")


@pytest.mark.parametrize("share", (0.1, 0.3, 0.5))
def test_two_nodes_of_which_nothing_tells_the_right_one_are_refused(share):
    samples = motion(hz=0.3)
    values = samples.values.copy()
    if share == 0.5:
        values[1::2] += 0.8
    else:
        values[np.random.default_rng(3).uniform(size=len(values)) < share] += 0.8
    with pytest.raises(RecordingError, match=r"jumps to and fro by [\d.]+ \d+ times in 1500 messages"):
        without_second_publisher("motor_encoder", CHANNELS, dataclasses.replace(samples, values=values))


@pytest.mark.parametrize("factor", (2, 4))
def test_of_a_staircase_the_first_of_each_run_stays(factor):
    samples = motion()
    kept, (notice,) = without_repetitions(
        "motor_encoder", dataclasses.replace(samples, values=np.repeat(samples.values[::factor], factor, axis=0))
    )
    assert kept.stamps.tolist() == samples.stamps[::factor].tolist()
    assert notice.text.startswith(f"motor_encoder: {factor} messages for each sample")


def lacking(samples, share=0.02):
    """The same samples, in some of which one joint or the other is no number, as the readers hand them on."""
    values = samples.values.copy()
    values[np.random.default_rng(5).random(values.shape) < share] = np.nan
    return without_gibberish("motor_encoder", CHANNELS, dataclasses.replace(samples, values=values))[0]


def test_commands_that_lack_numbers_in_different_joints_are_counted_together():
    samples = motion()
    values = samples.values.copy()
    values[::30, 0], values[15::30, 1] = np.nan, np.nan  # 3.3 % of either, which would be few
    lacking_some = dataclasses.replace(samples, values=values)
    with pytest.raises(RecordingError, match=r"a command, most often a.motor_position, is no number .* in 100 of 1500"):
        without_gibberish("command", CHANNELS, lacking_some)


@pytest.mark.parametrize("counts", (2 * np.pi / 4096, 1e-2), ids=("4096 counts", "coarse"))
@pytest.mark.parametrize("hz", (2.0, 0.05), ids=("fast", "slow"))
def test_what_fills_a_gap_lies_between_the_counts_of_an_encoder_and_is_no_sign_of_anything(counts, hz):
    samples = lacking(motion(counts=counts, hz=hz))
    assert samples.filled.any()
    loses_nothing(samples)


def test_a_staircase_and_glitches_are_found_among_numbers_that_lack():
    plain = motion(counts=1e-4)
    samples = lacking(dataclasses.replace(plain, values=np.repeat(plain.values[::4], 4, axis=0)))
    kept, (notice,) = without_repetitions("motor_encoder", samples)
    firsts = np.setdiff1d(
        np.append(plain.stamps[:600:4], plain.stamps[752::4]), samples.stamps[samples.filled.any(axis=1)]
    )
    assert notice.kind == "staircase" and np.isin(firsts, kept.stamps).all() and len(kept) < 0.3 * len(plain)
    plain.values[700, 0] += 0.5
    samples = lacking(plain)
    assert samples.measured[700, 0]
    kept, (notice,) = without_glitches("motor_encoder", CHANNELS, samples)
    assert set(samples.stamps) - set(kept.stamps) == {plain.stamps[700]}


def test_a_driver_a_little_faster_than_its_device_is_a_staircase_too():
    samples = motion()
    place = np.floor(np.arange(1500) * 0.8).astype(int)
    kept, _ = without_repetitions("motor_encoder", dataclasses.replace(samples, values=samples.values[place]))
    assert kept.values.tobytes() == samples.values[: place[-1] + 1].tobytes()


@pytest.mark.parametrize("seconds", (3.2, -0.35, 1.8e9))
def test_a_clock_that_was_set_is_told_by_reception_and_mended(seconds):
    samples = motion()
    other = motion(seed=2)
    at = 900
    shift = np.where(np.arange(1500) >= at, round(seconds * 1e9), 0)
    moved, seams, notices = on_one_clock(
        {"motor_encoder": samples.stamped(samples.stamps + shift), "imu1": other.stamped(other.stamps + shift)}
    )
    for name, clean in (("motor_encoder", samples), ("imu1", other)):
        late = (moved[name].stamps - clean.stamps) / 1e9
        assert np.all(late[:at] == 0) and np.ptp(late[at:]) == 0
        assert abs(late[-1]) < 1e-4  # a tenth of the jitter of reception
    assert moved["imu1"].stamps[-1] - moved["motor_encoder"].stamps[-1] == 0
    assert len(notices) == len(seams) == 2 and f"by {duration(seconds)} at message 900" in notices[0].text


def test_stamps_that_no_clock_counts_are_not_brought_together():
    samples = motion()
    stamps = samples.stamps.copy()
    stamps[700:] += int(5e9) * 10**9  # [ns] a clock set by 158 years
    with np.errstate(all="raise"):
        moved, seams, notices = on_one_clock({"motor_encoder": dataclasses.replace(samples, stamps=stamps)})
    assert np.array_equal(moved["motor_encoder"].stamps, stamps) and not seams and not notices


def test_a_queue_that_empties_is_no_clock():
    samples = motion()
    received = samples.received.copy()
    received[:200] += 60_000_000
    received = np.maximum.accumulate(received)
    _, seams, notices = on_one_clock({"imu1": dataclasses.replace(samples, received=received)})
    assert not seams and not notices


def test_streams_of_two_clocks_are_brought_together_and_the_offset_is_said():
    samples, other, third = motion(), motion(seed=2), motion(seed=3)
    behind = other.stamped(other.stamps - 7200 * 1_000_000_000)
    moved, (notice,) = brought_together({"motor_encoder": samples, "imu1": behind, "imu2": third})
    assert np.abs(moved["imu1"].stamps - other.stamps).max() < 100_000
    assert moved["imu2"].stamps is third.stamps
    assert notice.text.startswith("imu1: its stamps are 2 h 0 min behind those of the other streams")


def test_stamps_of_zero_and_single_wild_ones_are_left_out():
    samples = motion()
    stamps = samples.stamps.copy()
    stamps[:5] = 0
    stamps[800] += 10**15
    kept, notices = without_unfilled("imu1", samples.stamped(stamps))
    assert kept.stamps.tolist() == np.delete(samples.stamps, [0, 1, 2, 3, 4, 800]).tolist()
    assert [notice.count for notice in notices] == [5, 1]
    simulated = samples.stamped(samples.stamps - START)  # a clock that begins at zero
    assert without_unfilled("imu1", simulated) == (simulated, [])


def test_samples_without_numbers_are_left_out_and_a_stream_of_mostly_those_refused():
    samples = motion()
    values = samples.values.copy()
    values[[7, 9], 0] = np.nan, 1e300
    kept, (notice,) = without_gibberish("motor_encoder", CHANNELS, dataclasses.replace(samples, values=values))
    assert notice.count == 2 and notice.text == (
        "motor_encoder: left out what is no number (NaN or infinite): a.motor_position in 2 messages, the first at "
        "0.014 s; what the others of these messages say is used"
    )
    assert np.argwhere(kept.filled).tolist() == [[7, 0], [9, 0]] and len(kept) == 1500
    np.testing.assert_array_equal(kept.values[~kept.filled], samples.values[~kept.filled])
    assert np.abs(kept.values - samples.values).max() < 2e-4  # a spline through neighbours; nobody measures with it
    values[::3, 1] = np.inf
    kept, _ = without_gibberish("motor_encoder", CHANNELS, dataclasses.replace(samples, values=values))
    assert len(kept) == 1499 and kept.filled.sum() == 500  # the message at 9 lacks both
    values[:800, 1] = np.inf
    with pytest.raises(RecordingError, match=r"b.motor_position is no number .* in 1033 of 1500 messages \(68.9 %\)"):
        without_gibberish("motor_encoder", CHANNELS, dataclasses.replace(samples, values=values))


def test_commands_without_numbers_are_left_out_in_runs_but_only_few_alone():
    samples = motion()
    off = samples.values.copy()
    off[:600] = np.nan  # before the controller is switched on
    kept, (notice,) = without_gibberish("command", CHANNELS, dataclasses.replace(samples, values=off))
    assert len(kept) == 900 and notice.text == (
        "command: left out what is no number (NaN or infinite): a.motor_position in 600 messages, b.motor_position in "
        "600 messages, the first at 0.000 s"
    )
    off[700, 0] = np.nan
    kept, _ = without_gibberish("command", CHANNELS, dataclasses.replace(samples, values=off))
    np.testing.assert_array_equal(kept.values[100], [off[699, 0], off[700, 1]])  # the one before acts on, of one joint
    kept, _ = without_gibberish("command", CHANNELS, dataclasses.replace(samples, values=off), held=False)
    assert kept.values[100, 0] == pytest.approx(samples.values[700, 0], abs=2e-4)  # a measured one runs on
    off[600::10, 0] = np.nan  # whatever acted there stands in no message
    with pytest.raises(
        RecordingError,
        match=r"a.motor_position,? is no number .* let the node repeat its last command",
    ):
        without_gibberish("command", CHANNELS, dataclasses.replace(samples, values=off))
    off = samples.values.copy()
    off[:1000] = np.nan
    with pytest.raises(RecordingError, match=r"a.motor_position is no number .* use a part of the recording in which"):
        without_gibberish("command", CHANNELS, dataclasses.replace(samples, values=off))


def test_a_stream_of_which_nothing_is_a_number_is_refused_however_short():
    few = dataclasses.replace(motion().take(np.arange(4)), values=np.full((4, 2), np.nan))
    with pytest.raises(RecordingError, match=r"in 4 of 4 messages \(100 %\)"):
        without_gibberish("motor_encoder", CHANNELS, few)
    with pytest.raises(RecordingError, match="motor_encoder is empty"):
        in_time_order("motor_encoder", few.take(np.arange(0)))


def recording(gaps):
    times = np.arange(3000) / 1e3
    streams = {}
    for name in ("command", "motor_encoder", "imu1"):
        keep = np.ones(3000, bool)
        for t0, t1, some in gaps:
            keep &= ~((times > t0) & (times < t1)) | (name not in some)
        streams[name] = Stream(name, times[keep], np.zeros((keep.sum(), 1)), (name,), "")
    return Recording("run.bag", "", 0, streams)


def test_silences_are_left_out_with_their_reason():
    every = ("command", "motor_encoder", "imu1")
    found = with_silences_left_out(
        recording([(0.5, 0.8, every), (1.0, 1.1, ("command",)), (1.5, 1.6, every[1:]), (2.0, 2.5, every[1:])]),
        "motor_encoder",
    )
    assert np.round(found.left_out, 3).tolist() == [[0.5, 0.8], [1.0, 1.1], [2.0, 2.5]]
    assert found.notices[-1].text == (
        "left out, as too little is known there: 0.500 to 0.800 s (nothing at all was recorded for 0.3 s), "
        "1.000 to 1.100 s (no command for 0.1 s), 2.000 to 2.500 s (no encoder sample for 0.5 s); no equation of "
        "motion is asked to hold"
    )
    assert with_silences_left_out(recording([]), "motor_encoder").left_out == ()


def test_commands_that_come_only_when_they_change_are_never_silent():
    whole = recording([])
    times = np.cumsum(np.random.default_rng(4).exponential(0.1, 25))
    command = Stream("command", times, np.zeros((25, 1)), ("command",), "")
    sent = dataclasses.replace(whole, streams={**whole.streams, "command": command})
    assert with_silences_left_out(sent, "motor_encoder").left_out == ()


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(3e-7, "300 ns"), (3.84e-4, "384 us"), (0.021, "21 ms"), (-3.2, "3.2 s"), (7500.0, "2 h 5 min"),
     (1.767e9, "56 years"), (300.0, "5 min 0 s"), (1e6, "12 days"), (9.996e-4, "1 ms"),
     (0.09996, "0.1 s"), (10790.0, "3 h 0 min")],
)  # fmt: skip
def test_times_are_said_as_people_say_them(seconds, said):
    assert duration(seconds) == said


@pytest.mark.parametrize("wild", (1e308, -1e308, np.inf, np.nan))
def test_what_is_no_number_is_replaced_before_anything_squares_it(wild):
    samples = motion()
    values = samples.values.copy()
    values[700, 1] = wild
    with np.errstate(all="raise"):
        one = plausible_samples(
            "/joint_states", ordered_samples("/joint_states", dataclasses.replace(samples, values=values))
        )
        values[::2] = wild
        half = plausible_samples(
            "/joint_states", ordered_samples("/joint_states", dataclasses.replace(samples, values=values))
        )
    assert len(one) == 1500 and one.filled.sum() == 1 and abs(one.values - samples.values).max() < 1e-4
    assert len(half) == 1500 and half.filled[::2].all() and not half.filled[1::2].any()
    assert np.isfinite(half.values).all()


def test_a_counter_that_begins_anew_where_a_sample_is_missing_is_continued():
    samples = motion()
    turned = 4.0 * np.arange(1500)[:, None] / 1500 * 2 * np.pi + 0.1 * np.sin(np.arange(1500)[:, None] / 40.0)
    values = np.mod(turned, 2 * np.pi)
    values[100:1400:7] = np.nan
    spoilt = dataclasses.replace(samples, values=np.column_stack([values, samples.values[:, 1]]))
    kept, _ = without_gibberish("motor_encoder", CHANNELS, spoilt, wraps=2 * np.pi)
    np.testing.assert_allclose(kept.values[:, 0], turned[:, 0], atol=2e-4)


def test_a_long_run_is_bridged_by_a_straight_line_and_its_ends_stay():
    samples = motion()
    values = samples.values.copy()
    values[:50, 0] = values[300:400, 0] = np.nan
    kept, _ = without_gibberish("motor_encoder", CHANNELS, dataclasses.replace(samples, values=values))
    assert np.all(kept.values[:50, 0] == values[50, 0])
    np.testing.assert_allclose(
        kept.values[299:401, 0], np.linspace(values[299, 0], values[400, 0], 102), rtol=0, atol=1e-9
    )
