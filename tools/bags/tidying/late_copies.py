# SPDX-License-Identifier: BSD-3-Clause
"""A second node that repeats the messages of the driver a little later, as a relay does that stamps them anew.

Its sign: again and again a message is, to the last digit, one that was sent a moment before, while others in between
were not; all come about as late; they lie off the way that the others go; and what the driver sends is never the same
twice, so that this cannot be chance. A joint at rest, a coarse encoder, a periodic command and one that turns round
repeat themselves, too, but in long runs, all the time, after a long time, or on their way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted, duration
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.stale_levels import ALIKE, LATEST, SPREAD, stale_levels

Flags = NDArray[np.bool_]

FEWEST, SHARE = 5, 0.02  # copies, and share of the messages that they make
LONGEST_RUN = 3.0  # copies between two messages of the driver, in the mean
TYPICAL = 0.9  # quantile of how far messages lie off the line between their neighbours
OFF = 3.0  # times that far off are copies
NEARLY_ALL, TWICE = 0.95, 2.0  # quantile of the deviations from usual lateness, and how many times that is near
SAME_TIME = 1e-6  # [s]
NEVER_TWICE = 0.9  # share of the driver's different messages that no other one equals


def without_late_copies(name: str, samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The samples without those of a node that repeats others.

    Args:
        name: of the stream.
        samples: in the order of their stamps.
    """
    copies, later = _found(samples.stamps, samples.values)
    how = f"{duration(float(np.median(later[copies])))} later" if np.any(copies) else ""
    if not how:
        copies, usual = stale_levels(samples.stamps, samples.values)
        how = f"up to {duration(usual)} after it has sent another"
    count = int(np.count_nonzero(copies))
    if not count:
        return samples, []
    text = (
        f"{name}: left out {counted(count, 'message')} of a second node that repeats those of the driver {how}; stop "
        "it: `ros2 topic info -v` names it"
    )
    return samples.take(~copies), [Notice(name, "foreign", count, text)]


def late_copies(stamps: NDArray[np.int64], values: NDArray[np.float64]) -> Flags:
    """Which messages only repeat an earlier one, shape (n,); none where it may be chance.

    Args:
        stamps: in order, shape (n,) [ns].
        values: shape (n, m).
    """
    return _found(stamps, values)[0]


def _found(stamps: NDArray[np.int64], values: NDArray[np.float64]) -> tuple[Flags, NDArray[np.float64]]:
    """The same, and how long after the message that it repeats each comes, shape (n,) [s]."""
    none = np.zeros(len(values), bool), np.zeros(len(values))
    if len(values) < FEWEST or not values.shape[1]:
        return none
    known, before = _earlier(values)
    fresh = _fresh(values)
    later = (stamps - stamps[before]) / 1e9
    copies = known & fresh & (later < LATEST) & _sent_twice(values)
    if np.count_nonzero(copies) < max(FEWEST, SHARE * len(values)):
        return none
    usual = float(np.median(later[copies]))
    like = copies & (np.abs(later - usual) < SPREAD * usual)
    runs = int(np.count_nonzero(np.diff(like.astype(np.int8), prepend=0) == 1))
    if np.count_nonzero(like) < ALIKE * np.count_nonzero(copies) or like.sum() > LONGEST_RUN * runs:
        return none
    copies, later = _with_those_of_rest(stamps, values, like, later)
    return none if _likely(values[~copies]) or not _out_of_the_way(stamps, values, like, ~copies) else (copies, later)


def _with_those_of_rest(
    stamps: NDArray[np.int64], values: NDArray[np.float64], like: Flags, later: NDArray[np.float64]
) -> tuple[Flags, NDArray[np.float64]]:
    """All copies of a relay whose lateness is known, and how late each is [s].

    Each message of the driver has one about so much later, even where it equals many others, as those of a command at
    rest do. When the driver moves on, the relay repeats the rest for a while.
    """
    usual = float(np.median(later[like]))
    near = max(TWICE * float(np.quantile(np.abs(later[like] - usual), NEARLY_ALL)), SAME_TIME)
    at, copies, later = (stamps - stamps[0]) / 1e9, like.copy(), np.where(like, later, 0.0)
    repeated = set((np.searchsorted(at, at[like] - later[like] - SAME_TIME)).tolist())
    for i in range(len(at)):
        if copies[i] or i in repeated:
            continue
        first, last = np.searchsorted(at, [at[i] + usual - near, at[i] + usual + near])
        candidates = [k for k in range(first, last) if not copies[k] and np.array_equal(values[k], values[i])]
        if candidates:
            k = min(candidates, key=lambda k: abs(at[k] - at[i] - usual))
            copies[k], later[k] = True, at[k] - at[i]
    return copies, later


def _fresh(values: NDArray[np.float64]) -> Flags:
    """Whether a message differs from the one before it, shape (n,)."""
    return np.concatenate([[True], np.any(values[1:] != values[:-1], axis=1)])


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


def _out_of_the_way(stamps: NDArray[np.int64], values: NDArray[np.float64], copies: Flags, of_driver: Flags) -> bool:
    """Whether most copies lie off the way that the driver's messages go, as what was sent long before does."""
    at, own = (stamps - stamps[0]) / 1e9, values[of_driver]
    t = at[of_driver]
    if len(t) < FEWEST:
        return False
    share = ((t[1:-1] - t[:-2]) / np.maximum(t[2:] - t[:-2], 1e-9))[:, None]
    usual = np.quantile(np.abs(own[1:-1] - own[:-2] - share * (own[2:] - own[:-2])), TYPICAL, axis=0)
    between = np.column_stack([np.interp(at[copies], t, column) for column in own.T])
    off = np.abs(values[copies] - between) / np.maximum(usual, np.finfo(float).tiny)
    return float(np.median(np.max(np.where(usual > 0.0, off, 0.0), axis=1))) > OFF


def _sent_twice(values: NDArray[np.float64]) -> Flags:
    """Whether a message is there exactly twice, shape (n,): one of a command at rest, in its last digits, is often."""
    _, which, counts = np.unique(values, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(counts[which.ravel()] == 2)


def _likely(values: NDArray[np.float64]) -> bool:
    """Whether messages of the driver are so coarse that some are the same by chance."""
    fresh = values[_fresh(values)]
    return len(np.unique(fresh, axis=0)) < NEVER_TWICE * len(fresh)
