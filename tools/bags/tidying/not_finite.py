# SPDX-License-Identifier: BSD-3-Clause
"""Samples that are not numbers (NaN, infinite, beyond anything physical) are left out where they are few."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

MOST = 0.05  # share of the messages that may lack a number
FEW = 5  # or so many
LARGEST = 1e12  # [unit of the bag]


def numbers_only(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same values with NaN for what is none, so that nobody's squares overflow; the same array if all are."""
    some = np.abs(values) < LARGEST  # NaN compares false
    return values if some.all() else np.where(some, values, np.nan)


def without_gibberish(name: str, channels: tuple[str, ...], samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The samples in which every channel is a number.

    Raises:
        RecordingError: more than a few are not.
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
    if count > max(FEW, MOST * len(samples)) or count == len(samples):
        raise RecordingError(
            f"{channels[worst]} is no number (NaN or infinite) in {np.count_nonzero(bad[:, worst])} of "
            f"{len(samples)} messages ({100 * share:.3g} %), the first at {since:.3f} s; expected at most "
            f"{100 * MOST:g} %: check the field and the driver, or remove {name} from the robot file if it is a sensor "
            "that is not needed"
        )
    which = ", ".join(
        channel for channel, any_bad in zip(channels, np.asarray(bad.any(axis=0)), strict=True) if any_bad
    )
    text = (
        f"{name}: left out {counted(count, 'message')} that hold no number (NaN or infinite) in {which}, the first at "
        f"{since:.3f} s"
    )
    return samples.take(~rows), [Notice(name, "dropped", count, text)]
