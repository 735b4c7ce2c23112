# SPDX-License-Identifier: BSD-3-Clause
"""Wild samples: one to three in a row that leave where the channel was going and come back to it.

A run of samples is a glitch if all of it lies outside the range of its neighbours, on the same side: ten times farther
than any other sample nearby, and farther than anything moves from one sample to the next. Motion does not do
that, a stop and a reversal do not either. A counter that begins anew stays where it went.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.neighbours import beyond_neighbours, smallest_changes

Array = NDArray[np.float64]

LONGEST = 3  # samples in a row
FARTHER = 10.0  # times the distance of the other samples nearby
BEYOND_STEP = 1.5  # times the largest step nearby
NEARBY = 12  # samples on either side
ANYWHERE, FAST = 4.0, 0.95  # times this quantile of all steps: nothing else in the recording is like it
QUANTA = 10.0  # smallest changes of the channel
MOST_SHARE, MOST = 0.005, 5  # of the samples of a stream, or so many: more are no glitches


def without_glitches(
    name: str, channels: tuple[str, ...], samples: TimedSamples, period: float = 0.0
) -> tuple[TimedSamples, list[Notice]]:
    """The samples without wild ones.

    Args:
        name: of the stream.
        channels: name of each column.
        samples: in the order of their stamps, finite.
        period: after which the counter behind the values begins anew; 0 if it does not.

    Raises:
        RecordingError: there are so many that something else is wrong.
    """
    values = samples.values if not period else np.unwrap(samples.values, period=period, axis=0)
    since = (samples.stamps - samples.stamps[0]) / 1e9
    measured, wild = samples.measured, np.zeros(values.shape, bool)
    for j, seen in enumerate(measured.T):
        wild[seen, j] = wild_samples(values[seen, j])
    rows = np.asarray(wild.any(axis=1))
    count = int(np.count_nonzero(rows))
    if not count:
        return samples, []
    first = int(np.argmax(rows))
    channel = channels[int(np.argmax(wild[first]))]
    where = ", ".join(f"{t:.3f}" for t in since[rows][:5]) + (", ..." if count > 5 else "") + " s"
    if count > max(MOST, MOST_SHARE * len(samples)):
        raise RecordingError(
            f"{channel}: {count} of {len(samples)} samples of {name} jump away from their neighbours and back (at "
            f"{where} after its start); expected at most {max(MOST, int(MOST_SHARE * len(samples)))}: two nodes "
            "publish on this topic, a cable or a driver is broken, or the counter begins anew (`wraps` in the robot "
            "file); find the node with `ros2 topic info -v TOPIC`, and record again"
        )
    j = channels.index(channel)
    text = (
        f"{name}: left out {counted(count, 'wild sample')} (a glitch) at {where} after its start: {channel} reads "
        f"{samples.values[first, j]:.6g} between {samples.values[max(first - 1, 0), j]:.6g} and "
        f"{samples.values[min(first + 1, len(samples) - 1), j]:.6g}"
    )
    return samples.take(~rows), [Notice(name, "glitch", count, text)]


def wild_samples(column: Array) -> NDArray[np.bool_]:
    """Which samples of one channel are wild, shape (n,).

    Args:
        column: in the order of its stamps, shape (n,); where it wraps, continued.
    """
    found = np.zeros(len(column), bool)
    quantum = float(smallest_changes(column[:, None])[0])
    if len(column) < 2 * NEARBY or not np.isfinite(quantum):
        return found
    steps = np.abs(np.diff(column))
    floor = max(QUANTA * quantum, ANYWHERE * float(np.quantile(steps, FAST)))
    for length in range(1, LONGEST + 1):
        beyond = beyond_neighbours(column, length)
        for k in np.flatnonzero((beyond > floor) & (beyond > BEYOND_STEP * _largest_steps(column, length))):
            if not found[k : k + length].any() and _stands_alone(column, int(k), length, float(beyond[k])):
                found[k : k + length] = True
    found[_wild_ends(column, floor)] = True
    return found


def _largest_steps(column: Array, length: int) -> Array:
    """Largest step near the run of samples that begins at each, without those that touch it, shape (n,)."""
    n, width = len(column), NEARBY - 1
    steps = np.concatenate([np.zeros(NEARBY), np.abs(np.diff(column)), np.zeros(NEARBY + length)])
    largest = np.lib.stride_tricks.sliding_window_view(steps, width).max(axis=1)  # over those from k - NEARBY on
    k = np.arange(n)
    return np.maximum(largest[k], largest[np.minimum(k + NEARBY + length, len(largest) - 1)])


def _stands_alone(column: Array, k: int, length: int, beyond: float) -> bool:
    """Whether nothing near a run of samples is like it, once it is taken out."""
    others = np.concatenate([column[max(k - NEARBY, 0) : k], column[k + length : k + length + NEARBY]])
    if beyond <= FARTHER * float(beyond_neighbours(others).max(initial=0.0)):
        return False
    return beyond > BEYOND_STEP * float(np.abs(np.diff(others)).max(initial=0.0))


def _wild_ends(column: Array, floor: float) -> list[int]:
    """The first and the last sample, which have neighbours on one side only."""
    found = []
    for end, inner in ((0, column[1 : NEARBY + 1]), (len(column) - 1, column[-2 : -NEARBY - 2 : -1])):
        off = abs(column[end] - (3.0 * inner[0] - 3.0 * inner[1] + inner[2]))
        steps = np.abs(np.diff(inner))
        thirds = np.abs(np.diff(inner, 3)) if len(inner) > 3 else np.zeros(1)
        if off > max(floor, FARTHER * float(thirds.max()), 3.0 * BEYOND_STEP * float(steps.max())) and off > 0.0:
            found.append(end)
    return found
