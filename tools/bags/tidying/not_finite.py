# SPDX-License-Identifier: BSD-3-Clause
"""Samples that are not numbers (NaN, infinite, beyond anything physical): the rest of their messages is used.

A channel of a sensor that lacks a sample says less, and what it and the others say is right: a spline through its
neighbours stands there as `filled`, and no estimate takes it for a measurement. A command that is no number acts
somehow: where a few stand alone, that channel's command before acts on; where many follow each other, as before a
controller is switched on, the whole stretch is left out as one without commands. What a message is not about, because
another node tells of that joint (`filled` and NaN), is missing nowhere, and is filled in alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

MOST = 0.5  # share of the messages of a sensor that may lack a number
ALONE, FEW = 0.05, 5  # share of the commands, and number of them, that may lack one alone or almost alone
RUN = 6  # in a row leave a pause, in which no equation of motion is asked to hold
SMOOTH = 4  # samples in a row that a spline bridges; a longer way is a straight line
COMMAND = "command"  # name of that stream
LARGEST = 1e12  # [unit of the bag]


def numbers_only(values: Array) -> Array:
    """The same values with NaN for what is none, so that nobody's squares overflow; the same array if all are."""
    some = np.abs(values) < LARGEST  # NaN compares false
    return values if some.all() else np.where(some, values, np.nan)


def without_gibberish(
    name: str, channels: tuple[str, ...], samples: TimedSamples, wraps: float = 0.0, held: bool = True
) -> tuple[TimedSamples, list[Notice]]:
    """The samples in which some channel is a number, with what the others lack filled in.

    Args:
        name: of the stream.
        channels: name of each column.
        samples: in the order of their stamps, in the unit of the bag; `filled` where messages are not about a joint.
        wraps: period of the counter behind them, 0 for none; filled ones are continued.
        held: whether a command acts until the next one; else it was measured and runs on between its samples.

    Raises:
        RecordingError: too many are not.
    """
    values = numbers_only(samples.values)
    bad, absent = np.isnan(values), absent_in(samples)
    bad &= ~absent
    rows = np.asarray(bad.any(axis=1))
    acts_on = name == COMMAND and held
    if not rows.any():
        return filled_in(samples, wraps, acts_on), []
    _check_shares(name, channels, samples, bad)
    left_out = _in_runs(rows) if name == COMMAND else np.asarray((bad | absent).all(axis=1))
    lacking = {channel: int(n) for channel, n in zip(channels, bad.sum(axis=0), strict=True) if n}
    where = ", ".join(f"{channel} in {counted(n, 'message')}" for channel, n in lacking.items())
    since = (samples.stamps[int(np.argmax(rows))] - samples.stamps[0]) / 1e9
    rest = "" if left_out[rows].all() else "; what the others of these messages say is used"
    text = f"{name}: left out what is no number (NaN or infinite): {where}, the first at {since:.3f} s{rest}"
    kept = replace(samples, values=values).take(~left_out)
    kept = filled_in(kept, wraps, acts_on)
    return kept, [Notice(name, "dropped", int(np.count_nonzero(rows)), text)]


def filled_in(samples: TimedSamples, wraps: float = 0.0, acts_on: bool = False) -> TimedSamples:
    """The samples with values where channels hold NaN, flagged as filled; channels of NaN alone stay.

    Args:
        samples: in the order of their stamps.
        wraps: period of the counter behind them, 0 for none.
        acts_on: whether the last value before stands there, as that of a command does; not where many are no numbers.
    """
    bad = np.isnan(samples.values)
    if not bad.any():
        return samples
    missing = bad & ~absent_in(samples)
    times, values = (samples.stamps - samples.stamps[0]) / 1e9, samples.values.copy()
    for j in range(values.shape[1]):
        good = np.flatnonzero(~bad[:, j])
        if len(good) in (0, len(values)):
            continue
        column = values[good, j]
        if acts_on:
            before = np.maximum(np.searchsorted(good, np.arange(len(values)), side="right") - 1, 0)
            values[:, j] = np.where(_in_runs(missing[:, j]), np.nan, column[before])
            continue
        column = np.unwrap(column, period=wraps) if wraps else column
        bridged = _bridged(times, times[good], column)
        bridged[good] = column  # a spline may round it
        values[:, j] = bridged
    return replace(samples, values=values, filled=bad & ~np.isnan(values))


def absent_in(samples: TimedSamples) -> Flags:
    """Where messages are not about a joint, shape (n, m)."""
    return np.zeros(samples.values.shape, bool) if samples.filled is None else samples.filled


def _bridged(times: Array, known: Array, column: Array) -> Array:
    """A channel at all times: what is known, a spline between, straight lines where much is missing, shape (n,)."""
    from scipy.interpolate import CubicSpline

    straight = np.interp(times, known, column)
    if len(known) < 4:
        return straight
    outside = (times < known[0]) | (times > known[-1])
    steps = np.diff(known)
    between = np.clip(np.searchsorted(known, times) - 1, 0, len(steps) - 1)
    long = steps[between] > (SMOOTH + 1.5) * float(np.median(steps))
    return np.asarray(np.where(long | outside, straight, CubicSpline(known, column)(times)), dtype=np.float64)


def _check_shares(name: str, channels: tuple[str, ...], samples: TimedSamples, bad: Flags) -> None:
    counts = np.count_nonzero(bad, axis=0)
    worst = int(np.argmax(counts))
    n = len(samples) - int(np.count_nonzero(absent_in(samples)[:, worst]))
    too_many, scattered = counts[worst] > MOST * n, False
    if name == COMMAND:
        rows = np.asarray(bad.any(axis=1))
        scattered = bool(np.count_nonzero(rows & ~_in_runs(rows)) > max(FEW, ALONE * n))
        too_many |= scattered or rows.sum() > MOST * n
    if too_many:
        since = (samples.stamps[int(np.argmax(bad.any(axis=1)))] - samples.stamps[0]) / 1e9
        lacking = int(np.count_nonzero(bad.any(axis=1)))
        count = lacking if name == COMMAND else int(counts[worst])
        what = channels[worst] if count == counts[worst] else f"a command, most often {channels[worst]},"
        raise RecordingError(
            f"{what} is no number (NaN or infinite) in {count} of {n} messages "
            f"({100 * count / n:.3g} %), the first at {since:.3f} s; expected at most {_expected(name)}: "
            f"{_way_out(name, scattered)}"
        )


def _in_runs(rows: Flags) -> Flags:
    """Of some rows those that stand in a run of at least so many, shape (n,)."""
    edges = np.flatnonzero(np.diff(rows.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    found = np.zeros_like(rows)
    for begin, end in edges:
        found[begin:end] = end - begin >= RUN
    return found


def _expected(name: str) -> str:
    if name != COMMAND:
        return f"{100 * MOST:g} %"
    return f"{100 * ALONE:g} % beside runs of {RUN} and more, and {100 * MOST:g} % in all"


def _way_out(name: str, scattered: bool) -> str:
    """What to do; commands that are missing one by one all over the recording are no pauses."""
    if name == COMMAND and scattered:
        return (
            "nothing says what acted then: let the node repeat its last command where it has no new one and record "
            "again, or record the effort that the motors report beside the positions"
        )
    if name == COMMAND:
        return (
            "use a part of the recording in which the drives are on, cut out with `ros2 bag convert`, or record again"
        )
    if name == "motor_encoder":
        return "check the encoder; a joint without one is left out by `jointscope init URDF BAG --joints A,B,...`"
    return f"check the field and the driver, or remove {name} from the robot file if that sensor is not needed"
