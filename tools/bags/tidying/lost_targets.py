# SPDX-License-Identifier: BSD-3-Clause
"""Samples of a tracker that has lost its target: zeros, the last position over and over, another target for a while.

A target moves on from sample to sample. What jumps away from that way, farther than ever from one sample to the next,
and comes back to it, was something else. The longest stretch without a jump is taken for the target.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

REPEATED = 5  # samples in a row that are the same to the last digit
NOISY = 0.05  # share of repetitions up to which a tracker is one that never repeats itself
FAST, JUMP = 0.9, 8.0  # times this quantile of all speeds is no motion
MOST = 0.5  # share of the samples that may be lost


def without_lost(name: str, samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The samples without those of a lost target, and how many they were.

    Args:
        name: of the stream.
        samples: positions in the order of their stamps, finite, shape (n, 3).

    Raises:
        RecordingError: most are lost.
    """
    values = samples.values
    zero = np.asarray(np.all(values == 0.0, axis=1))
    same = _repetitions(values) & ~zero
    away = np.zeros(len(values), bool)
    rest = np.flatnonzero(~(zero | same))
    if len(rest) > REPEATED:
        away[rest] = _elsewhere((samples.stamps[rest] - samples.stamps[0]) / 1e9, values[rest])
    lost = zero | same | away
    count = int(np.count_nonzero(lost))
    if not count:
        return samples, []
    kinds = ((zero, "zeros"), (same, "repetitions of one position"), (away, "of a jump away and back"))
    which = ", ".join(f"{np.count_nonzero(rows)} {kind}" for rows, kind in kinds if rows.any())
    since = (samples.stamps[int(np.argmax(lost))] - samples.stamps[0]) / 1e9
    text = f"{counted(count, 'sample')} of {len(values)} without its target ({which}), the first at {since:.3f} s"
    if count > MOST * len(values):
        raise RecordingError(
            f"{name}: {text}; expected at most {100 * MOST:g} %: look whether the tracker sees the target, or remove "
            f"sensors.{name} from the robot file"
        )
    return samples.take(~lost), [Notice(name, "dropped", count, f"{name}: left out {text}")]


def _repetitions(values: Array) -> Flags:
    """Samples in long runs of the same position, but for the first of each, shape (n,); none where that is usual."""
    same = np.concatenate([[False], np.all(values[1:] == values[:-1], axis=1)])
    edges = np.flatnonzero(np.diff(same.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    found = np.zeros(len(values), bool)
    for begin, end in edges:
        found[begin:end] = end - begin >= REPEATED
    usual = int(np.count_nonzero(same & ~found)) > NOISY * int(np.count_nonzero(~found))
    return np.zeros(len(values), bool) if usual else found


def _elsewhere(times: Array, values: Array) -> Flags:
    """Samples that jumps separate from the longest stretch, and that do not follow on from it, shape (n,)."""
    steps, h = np.linalg.norm(np.diff(values, axis=0), axis=1), np.diff(times)
    speeds = steps / h
    fastest = JUMP * float(np.quantile(speeds[speeds > 0.0], FAST)) if speeds.any() else np.inf
    cuts = np.flatnonzero(speeds > fastest) + 1
    if not len(cuts):
        return np.zeros(len(values), bool)
    bounds = np.concatenate([[0], cuts, [len(values)]])
    parts: list[tuple[int, int]] = list(zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True))
    longest = max(range(len(parts)), key=lambda k: parts[k][1] - parts[k][0])
    kept = np.zeros(len(values), bool)
    kept[slice(*parts[longest])] = True
    last = parts[longest][1] - 1
    for begin, end in parts[longest + 1 :]:
        if _follows(times, values, last, begin, fastest):
            kept[begin:end], last = True, end - 1
    first = parts[longest][0]
    for begin, end in reversed(parts[:longest]):
        if _follows(times, values, end - 1, first, fastest):
            kept[begin:end], first = True, begin
    return ~kept


def _follows(times: Array, values: Array, before: int, after: int, fastest: float) -> bool:
    """Whether a target can have come from one sample to another at the usual speed."""
    way = float(np.linalg.norm(values[after] - values[before]))
    return way <= fastest * float(times[after] - times[before]) and before + 1 < after
