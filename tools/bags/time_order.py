# SPDX-License-Identifier: BSD-3-Clause
"""Puts samples into the order of their stamps, or says that the clock cannot be trusted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recording import Notice

LATE_ALLOWED = 0.5  # [s] messages overtake each other by less than this; more is a clock that was set back
FORWARD_ALLOWED = 3600.0  # [s] a longer pause inside one stream is a clock that was set
RUN_OF_LATE_SAMPLES = 10  # this many in a row, between samples that were there already, is a clock, too


@dataclass(frozen=True)
class TimedSamples:
    """Samples with their two times.

    Attributes:
        stamps: time of measurement, shape (n,) [ns].
        received: time of writing to the bag, shape (n,) [ns].
        values: shape (n, m).
    """

    stamps: NDArray[np.int64]
    received: NDArray[np.int64]
    values: NDArray[np.float64]

    def take(self, index: NDArray[np.intp]) -> TimedSamples:
        """Some of the samples."""
        return TimedSamples(self.stamps[index], self.received[index], self.values[index])


def in_time_order(name: str, samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The samples with strictly increasing stamps.

    Samples that overtook each other are sorted; of samples with the same stamp the first one written stays.

    Args:
        name: name of the stream.
        samples: as they lie in the bag; at least one.

    Returns:
        The samples in order, and what was done to them.

    Raises:
        RecordingError: all stamps are the same, or the clock jumps.
    """
    stamps = samples.stamps
    if len(stamps) > 1 and np.all(stamps == stamps[0]):
        raise RecordingError(
            f"{name}: all {len(stamps)} messages have the same stamp {stamps[0] / 1e9:.9f} s; expected the time of "
            "measurement in header.stamp: the driver does not fill it"
        )
    _check_clock(name, stamps)
    notices = []
    late = int(np.count_nonzero(stamps < np.maximum.accumulate(stamps)))
    if late:
        samples = samples.take(np.argsort(stamps, kind="stable"))
        worst = float((np.maximum.accumulate(stamps) - stamps).max()) / 1e9
        text = f"{name}: {late} samples came out of order, at most {worst:.4g} s late; sorted by stamp"
        notices.append(Notice(name, "out_of_order", late, text))
    keep = np.flatnonzero(np.diff(samples.stamps, prepend=samples.stamps[0] - 1))
    dropped = len(samples.stamps) - len(keep)
    if dropped:
        text = f"{name}: {dropped} samples repeat the stamp of the one before; dropped, the first of each stays"
        notices.append(Notice(name, "duplicate", dropped, text))
        samples = samples.take(keep)
    return samples, notices


def _check_clock(name: str, stamps: NDArray[np.int64]) -> None:
    newest = np.maximum.accumulate(stamps)
    late = newest - stamps
    ahead = np.diff(np.sort(stamps))
    if len(ahead) and ahead.max() > FORWARD_ALLOWED * 1e9:
        k = int(np.argmax(np.diff(newest))) + 1
        raise RecordingError(
            f"{name}: the stamps jump forward by {ahead.max() / 1e9:.4g} s at message {k}; expected one clock without "
            "jumps: cut the recording there"
        )
    steps = np.diff(stamps)
    back = int(np.argmin(steps)) + 1 if len(steps) else 0
    if late.max() > LATE_ALLOWED * 1e9 or _runs_twice(stamps, late > 0):
        raise RecordingError(
            f"{name}: the stamps go back by {-steps[back - 1] / 1e9:.4g} s at message {back} and do not recover; "
            "expected one clock without jumps: cut the recording there"
        )


def _runs_twice(stamps: NDArray[np.int64], late: NDArray[np.bool_]) -> bool:
    """Whether an orderly run of late samples covers a span of time that earlier samples had covered already.

    Messages that were merely delayed fill the hole that they left; a clock that was set back does not.
    """
    continues = late & (np.diff(stamps, prepend=stamps[0]) > 0)
    starts = np.flatnonzero(~continues)
    lengths = np.diff(starts, append=len(stamps))
    for start, length in zip(starts, lengths, strict=True):
        if length < RUN_OF_LATE_SAMPLES or not late[start]:
            continue
        before, first, last = stamps[:start], stamps[start], stamps[start + length - 1]
        if np.count_nonzero((before >= first) & (before <= last)) > 0.5 * length:
            return True
    return False
