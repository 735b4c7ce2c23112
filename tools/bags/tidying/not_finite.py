# SPDX-License-Identifier: BSD-3-Clause
"""Samples that are not numbers (NaN, infinite, beyond anything physical) are left out where enough others are there.

A sensor that lacks samples says less, and what it says is right. A command that is no number acts somehow: where a few
stand alone, the one before acts on; where many follow each other, as before a controller is switched on, the whole
stretch is left out as one without commands.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

MOST = 0.5  # share of the messages of a sensor that may lack a number
ALONE, FEW = 0.05, 5  # share of the commands, and number of them, that may lack one alone or almost alone
RUN = 6  # in a row leave a pause, in which no equation of motion is asked to hold
COMMAND = "command"  # name of that stream
LARGEST = 1e12  # [unit of the bag]


def numbers_only(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same values with NaN for what is none, so that nobody's squares overflow; the same array if all are."""
    some = np.abs(values) < LARGEST  # NaN compares false
    return values if some.all() else np.where(some, values, np.nan)


def without_gibberish(name: str, channels: tuple[str, ...], samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The samples in which every channel is a number.

    Raises:
        RecordingError: too many are not.
    """
    bad: NDArray[np.bool_] = ~(np.abs(samples.values) < LARGEST)  # NaN compares false
    rows = np.asarray(bad.any(axis=1))
    count = int(np.count_nonzero(rows))
    if not count:
        return samples, []
    worst = int(np.argmax(bad.sum(axis=0)))
    share = float(bad[:, worst].mean())
    first = int(np.argmax(rows))
    since = (samples.stamps[first] - samples.stamps.min()) / 1e9
    counted_ones = _alone(rows) if name == COMMAND else rows
    allowed = max(FEW, ALONE * len(samples)) if name == COMMAND else MOST * len(samples)
    if np.count_nonzero(counted_ones) > allowed or count > MOST * len(samples):
        raise RecordingError(
            f"{channels[worst]} is no number (NaN or infinite) in {np.count_nonzero(bad[:, worst])} of "
            f"{len(samples)} messages ({100 * share:.3g} %), the first at {since:.3f} s; expected at most "
            f"{_expected(name)}: {_way_out(name)}"
        )
    which = ", ".join(
        channel for channel, any_bad in zip(channels, np.asarray(bad.any(axis=0)), strict=True) if any_bad
    )
    text = (
        f"{name}: left out {counted(count, 'message')} that hold no number (NaN or infinite) in {which}, the first at "
        f"{since:.3f} s"
    )
    return samples.take(~rows), [Notice(name, "dropped", count, text)]


def _alone(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of some rows those that do not stand in a long run of them, shape (n,)."""
    edges = np.flatnonzero(np.diff(rows.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    alone = rows.copy()
    for begin, end in edges:
        if end - begin >= RUN:
            alone[begin:end] = False
    return alone


def _expected(name: str) -> str:
    if name != COMMAND:
        return f"{100 * MOST:g} %"
    return f"{100 * ALONE:g} % beside runs of {RUN} and more, and {100 * MOST:g} % in all"


def _way_out(name: str) -> str:
    if name == COMMAND:
        return (
            "use a part of the recording in which the drives are on, cut out with `ros2 bag convert`, or record again"
        )
    if name == "motor_encoder":
        return "check the encoder; a joint without one is left out by `jointscope init URDF BAG --joints A,B,...`"
    return f"check the field and the driver, or remove {name} from the robot file if that sensor is not needed"
