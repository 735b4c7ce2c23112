# SPDX-License-Identifier: BSD-3-Clause
"""Messages that come faster than the device is read repeat its last sample: a staircase.

Its sign: while a channel moves by several of its smallest steps from one change to the next, samples in between repeat
all channels exactly. A joint at rest, or one that moves by single counts, repeats itself, too, but does not jump. The
first message of each run is the sample; the repetitions carry no information, and would make the noise look smaller.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.neighbours import smallest_changes

QUANTA = 3.0  # smallest changes of a channel that a change during motion spans
SHARE = 0.1  # of the messages during motion that must repeat
FEWEST = 30  # changes during motion
LONGEST_RUN = 50  # messages per sample of the device


def without_repetitions(name: str, samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The first message of each run of a staircase; all samples where there is none.

    Args:
        name: of the stream.
        samples: in the order of their stamps, finite.
    """
    values = samples.held  # what fills a gap lies between the steps of a counter
    repeats = np.concatenate([[False], np.all(values[1:] == values[:-1], axis=1)])
    runs = _runs_in_motion(values, repeats & samples.measured.all(axis=1))
    if len(runs) < FEWEST or float(np.mean(runs)) < 1.0 / (1.0 - SHARE):
        return samples, []
    per_sample = float(np.mean(runs))
    every = max(round(float(np.median(runs))), 1)
    keep = _kept(repeats, every, int(np.max(runs)))
    dropped = int(np.count_nonzero(~keep))
    text = (
        f"{name}: {per_sample:.3g} messages for each sample: the driver publishes faster than it reads its device; the "
        f"first of each run is used, {dropped} repetitions of {len(samples)} messages are left out"
    )
    return samples.take(keep), [Notice(name, "staircase", dropped, text)]


def _runs_in_motion(values: NDArray[np.float64], repeats: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Messages from one change to the next, between changes that both are those of motion."""
    steps = np.abs(np.diff(values, axis=0))
    fast = np.concatenate([[False], np.any(steps >= QUANTA * smallest_changes(values), axis=1)])
    changes = np.flatnonzero(~repeats)
    both = fast[changes[1:]] & fast[changes[:-1]]
    runs = np.diff(changes)[both]
    return runs[runs <= LONGEST_RUN]


def _kept(repeats: NDArray[np.bool_], every: int, longest: int) -> NDArray[np.bool_]:
    """The first of each run; of a rest that is longer than any run in motion one in `every`."""
    index = np.arange(len(repeats))
    begin = np.maximum.accumulate(np.where(repeats, 0, index))
    place = index - begin
    lengths = np.bincount(begin, minlength=len(repeats))[begin]
    return np.where(lengths > longest, place % every == 0, place == 0)
