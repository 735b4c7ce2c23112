# SPDX-License-Identifier: BSD-3-Clause
"""A second node that repeats the messages of the driver a little later, as a relay does that stamps them anew.

Its sign: again and again a message is, to the last digit, one that was sent a moment before, while others in between
were not; and what the driver sends is never the same twice, so that this cannot be chance. A joint at rest, a coarse
encoder and a periodic command repeat themselves, too, but in long runs, or all the time, or after a long time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted, duration
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

Flags = NDArray[np.bool_]

FEWEST, SHARE = 5, 0.02  # copies, and share of the messages that they make
LATEST = 1.0  # [s] after the message that is repeated
ALIKE = 0.8  # share of the copies that come about as late as is usual
TIMES_USUAL = 2.0  # how much later than usual copies may come
LONGEST_RUN = 3.0  # copies between two messages of the driver, in the mean
NEVER_TWICE = 0.9  # share of the driver's different messages that no other one equals


def without_late_copies(name: str, samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The samples without those of a node that repeats others.

    Args:
        name: of the stream.
        samples: in the order of their stamps.
    """
    copies = late_copies(samples.stamps, samples.values)
    count = int(np.count_nonzero(copies))
    if not count:
        return samples, []
    _, before = _earlier(samples.values)
    later = float(np.median((samples.stamps - samples.stamps[before])[copies])) / 1e9
    text = (
        f"{name}: left out {counted(count, 'message')} of a second node that repeats those of the driver "
        f"{duration(later)} later; stop it: `ros2 topic info -v` names it"
    )
    return samples.take(~copies), [Notice(name, "foreign", count, text)]


def late_copies(stamps: NDArray[np.int64], values: NDArray[np.float64]) -> Flags:
    """Which messages only repeat an earlier one, shape (n,); none where it may be chance.

    Args:
        stamps: in order, shape (n,) [ns].
        values: shape (n, m).
    """
    none = np.zeros(len(values), bool)
    if len(values) < FEWEST or not values.shape[1]:
        return none
    known, before = _earlier(values)
    fresh = np.concatenate([[True], np.any(values[1:] != values[:-1], axis=1)])
    later = (stamps - stamps[before]) / 1e9
    copies = known & fresh & (later < LATEST) & _sent_twice(values)
    if np.count_nonzero(copies) < max(FEWEST, SHARE * len(values)):
        return none
    usual = float(np.median(later[copies]))
    like = copies & (later < TIMES_USUAL * usual) & (later * TIMES_USUAL > usual)
    runs = int(np.count_nonzero(np.diff(like.astype(np.int8), prepend=0) == 1))
    own = np.count_nonzero(fresh & ~copies)
    twice = np.count_nonzero(known & fresh & ~copies)
    if np.count_nonzero(like) < ALIKE * np.count_nonzero(copies) or like.sum() > LONGEST_RUN * runs:
        return none
    return like if own and twice <= (1.0 - NEVER_TWICE) * own and not _likely(values[~like]) else none


def _earlier(values: NDArray[np.float64]) -> tuple[Flags, NDArray[np.intp]]:
    """Whether a message was there before, but not just before, and where it was last, shape (n,) each."""
    n = len(values)
    column = values[:, int(np.argmax([len(np.unique(column)) for column in values.T]))]
    order = np.argsort(column, kind="stable")
    before = np.arange(n)
    before[order[1:]] = order[:-1]
    before[order[0]] = order[0]
    known = (before < np.arange(n) - 1) & np.all(values == values[before], axis=1)
    return known, np.where(known, before, np.arange(n))


def _sent_twice(values: NDArray[np.float64]) -> Flags:
    """Whether a message is there exactly twice, shape (n,): one of a command at rest, in its last digits, is often."""
    _, which, counts = np.unique(values, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(counts[which.ravel()] == 2)


def _likely(values: NDArray[np.float64]) -> bool:
    """Whether messages of the driver are so coarse that some are the same by chance."""
    fresh = values[np.concatenate([[True], np.any(values[1:] != values[:-1], axis=1)])]
    return len(np.unique(fresh, axis=0)) < NEVER_TWICE * len(fresh)
