# SPDX-License-Identifier: BSD-3-Clause
"""A second node that publishes the same constant message now and then, such as zeros, among those of the driver.

Its sign: one and the same sample comes back again and again, each time alone or nearly so, while the samples before and
after it go on as if it were not there. A joint at rest repeats a sample, too, but all around it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.neighbours import smallest_changes

FEWEST = 3  # visits
LONGEST_VISIT = 3  # samples
FARTHER = 10.0  # the way there and back, in usual steps of the other samples
MOST_VISITS = 0.8  # share of the visits that must lead far away
LOOKED_AT = 5  # samples that come most often
FAR = 20.0  # usual ways over two samples: a jump
MIXED = 0.03  # share of the samples that jump there and back


def without_second_publisher(
    name: str, channels: tuple[str, ...], samples: TimedSamples
) -> tuple[TimedSamples, list[Notice]]:
    """The samples without those of a node that repeats itself.

    Args:
        name: of the stream.
        channels: name of each column.
        samples: in the order of their stamps, finite.

    Raises:
        RecordingError: two nodes publish, and nothing tells which of them is right.
    """
    foreign = of_second_publisher(samples.held)
    count = int(np.count_nonzero(foreign))
    kept, notices = samples.take(~foreign), []
    if count:
        said = ", ".join(f"{x:.6g}" for x in samples.values[int(np.argmax(foreign))])
        text = (
            f"{name}: left out {counted(count, 'message')} of a second node that publishes always the same ({said}) "
            f"between those of the driver, {counted(len(kept), 'message')}; stop it: `ros2 topic info -v` names it"
        )
        notices.append(Notice(name, "foreign", count, text))
    _refuse_mixed(name, channels, kept)
    return kept, notices


def of_second_publisher(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which samples are those of a node that repeats itself, shape (n,).

    Args:
        values: in the order of their stamps, finite, shape (n, m).
    """
    _, which, counts = np.unique(values, axis=0, return_inverse=True, return_counts=True)
    which = which.reshape(-1)
    foreign = np.zeros(len(values), bool)
    for value in np.argsort(-counts)[:LOOKED_AT]:
        if counts[value] >= FEWEST and _comes_and_goes(values, which == value):
            foreign |= which == value
    return foreign


def _comes_and_goes(values: NDArray[np.float64], is_it: NDArray[np.bool_]) -> bool:
    """Whether a sample visits a stream that goes on without it."""
    edges = np.flatnonzero(np.diff(is_it.astype(np.int8), prepend=0, append=0))
    begins, ends = edges[::2], edges[1::2]
    inside = (begins > 0) & (ends < len(values))
    visits = int(np.count_nonzero(inside))
    if visits < FEWEST or np.median(ends - begins) > LONGEST_VISIT:
        return False
    begins, ends = begins[inside], ends[inside]
    away = np.abs(values[begins] - values[begins - 1])
    bridge = np.abs(values[ends] - values[begins - 1])
    rest = values[~is_it]
    if len(rest) < 2:
        return False
    steps = np.abs(np.diff(rest, axis=0))
    usual = np.maximum(np.median(steps, axis=0), smallest_changes(rest))  # at rest an encoder wavers between counts
    far = np.any(away > FARTHER * np.maximum(bridge, usual), axis=1)
    return bool(far.mean() >= MOST_VISITS)


def _refuse_mixed(name: str, channels: tuple[str, ...], samples: TimedSamples) -> None:
    """Two streams woven into one: again and again the next sample is far away, and the one after it is near."""
    if len(samples) < 20:
        return
    values = samples.held
    back = np.abs(values[2:] - values[:-2])
    there = np.abs(np.diff(values, axis=0))[:-1]
    usual = np.maximum(np.median(back, axis=0), smallest_changes(values[::2]))
    jumps = (there > FAR * usual) & (FARTHER * back < there)
    counts = np.count_nonzero(jumps, axis=0)
    worst = int(np.argmax(counts))
    if counts[worst] > MIXED * len(samples):
        size = float(np.median(there[jumps[:, worst], worst]))
        raise RecordingError(
            f"{channels[worst]} jumps to and fro by {size:.4g} {counts[worst]} times in {len(samples)} messages of "
            f"{name}: two nodes publish on this topic, and nothing shows which is right, or the clock of the recorder "
            "was set back, so that two stretches lie on each other; expected one node and one clock: find nodes with "
            "`ros2 topic info -v TOPIC`, and record again"
        )
