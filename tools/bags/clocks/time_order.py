# SPDX-License-Identifier: BSD-3-Clause
"""Puts samples into the order of their stamps, or says that the clock cannot be trusted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted, duration
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

LATE_ALLOWED = 0.5  # [s] messages overtake each other by less than this; more is a clock that was set back
FORWARD_ALLOWED = 3600.0  # [s] more than between the times of reception is a clock that was set
CUT = (
    "use the part before or after it, cut out with `ros2 bag convert` (start_time_ns, end_time_ns) or `rosbag filter`, "
    "or record again"
)
RUN_OF_LATE_SAMPLES = 10  # this many in a row, between samples that were there already, is a clock, too


def in_time_order(name: str, samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The samples with strictly increasing stamps.

    Samples that overtook each other are sorted; of samples with the same stamp the first one written stays.

    Args:
        name: name of the stream.
        samples: as they lie in the bag.

    Returns:
        The samples in order, and what was done to them.

    Raises:
        RecordingError: there is none, all stamps are the same, or the clock jumps.
    """
    stamps = samples.stamps
    if not len(stamps):
        raise RecordingError(f"{name} is empty: it holds no sample that can be used")
    if len(stamps) > 1 and np.all(stamps == stamps[0]):
        raise RecordingError(
            f"{name}: all {len(stamps)} messages have the same stamp {stamps[0] / 1e9:.9f} s; expected the time of "
            "measurement in header.stamp: the driver does not fill it"
        )
    _check_clock(name, samples)
    notices = []
    late = int(np.count_nonzero(stamps < np.maximum.accumulate(stamps)))
    if late:
        samples = samples.take(np.argsort(stamps, kind="stable"))
        worst = duration(float((np.maximum.accumulate(stamps) - stamps).max()) / 1e9)
        text = f"{name}: {counted(late, 'sample')} came out of order, at most {worst} late; sorted by stamp"
        notices.append(Notice(name, "out_of_order", late, text))
    keep = np.flatnonzero(np.diff(samples.stamps, prepend=samples.stamps[0] - 1))
    dropped = len(samples.stamps) - len(keep)
    if dropped:
        text = (
            f"{name}: left out {counted(dropped, 'sample')} with the stamp of the one before; the first of each stays"
        )
        notices.append(Notice(name, "duplicate", dropped, text))
        samples = samples.take(keep)
    return samples, notices


def _check_clock(name: str, samples: TimedSamples) -> None:
    stamps = samples.stamps
    newest = np.maximum.accumulate(stamps)
    late = newest - stamps
    order = np.argsort(stamps, kind="stable")
    ahead = np.diff(stamps[order]) - np.maximum(np.diff(samples.received[order]), 0)  # a pause is none
    if len(ahead) and ahead.max() > FORWARD_ALLOWED * 1e9:
        k = int(np.argmax(np.diff(newest))) + 1
        raise RecordingError(
            f"{name}: the stamps jump forward by {duration(ahead.max() / 1e9)} at message {k}, and the times of "
            f"reception do not explain why; expected one clock without jumps: {CUT}"
        )
    steps = np.diff(stamps)
    back = int(np.argmin(steps)) + 1 if len(steps) else 0
    if late.max() > LATE_ALLOWED * 1e9 or _runs_twice(stamps, late > 0):
        raise RecordingError(
            f"{name}: the stamps go back by {duration(steps[back - 1] / 1e9)} at message {back} and do not recover, "
            f"and the times of reception do not explain why; expected one clock without jumps: {CUT}"
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
