# SPDX-License-Identifier: BSD-3-Clause
"""Long stretches in which nothing at all was recorded are made short: how long they were says nothing about the robot.

A recorder that was stopped and started again leaves a hole of minutes or hours. States would have to be estimated all
through it, and pictures would show little else. Every stream keeps its place beside the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Notice, Recording, Stream
from jointscope.tools.bags.clocks.durations import duration

Array = NDArray[np.float64]

LONGEST = 5.0  # [s] of a hole that stays as it is
LEFT = 1.0  # [s] of a longer one
PERIODS = 20.0  # of the slowest stream: what comes this seldom has no hole
SAID = 5  # holes listed


@dataclass(frozen=True)
class LongHoles:
    """Holes in all streams of a bag.

    Attributes:
        begins, ends: of each, shape (k,) [s].
    """

    begins: Array
    ends: Array

    @staticmethod
    def of(streams: Sequence[Array]) -> LongHoles:
        """Those with samples of at least two streams on both sides; else the streams are of different times.

        Args:
            streams: times of each, increasing [s]; empty ones say nothing.
        """
        streams = [times for times in streams if len(times)]
        if not streams:
            return LongHoles(np.empty(0), np.empty(0))
        every = np.unique(np.concatenate(streams))
        slowest = max((float(np.median(np.diff(times))) for times in streams if len(times) > 1), default=0.0)
        far = np.flatnonzero(np.diff(every) > max(LONGEST, PERIODS * slowest))
        begins, ends = every[far], every[far + 1]
        across = sum(((times[0] <= begins) & (times[-1] >= ends)).astype(int) for times in streams)
        long = across >= min(2, len(streams))
        return LongHoles(begins[long], ends[long])

    def __len__(self) -> int:
        return len(self.begins)

    def shortened(self, times: Array) -> Array:
        """The times without most of the holes before them; the same array without holes."""
        if not len(self):
            return times
        before = np.clip(times[:, None], self.begins, self.ends) - self.begins
        spans = self.ends - self.begins
        return np.asarray(times - (before * (1.0 - LEFT / spans)).sum(axis=1))


def with_short_holes(recording: Recording) -> Recording:
    """The recording with its long holes made short, and a notice that says which."""
    holes = LongHoles.of([stream.times for stream in recording.streams.values()])
    if not len(holes):
        return recording
    streams = {name: _moved(stream, holes) for name, stream in recording.streams.items()}
    goal = None if recording.goal is None else _moved(recording.goal, holes)
    left_out = tuple((float(a), float(b)) for a, b in (holes.shortened(np.array(part)) for part in recording.left_out))
    begins, spans = holes.shortened(holes.begins), holes.ends - holes.begins
    said = ", ".join(f"{duration(t)} after {t0:.3f} s" for t0, t in zip(begins[:SAID], spans[:SAID], strict=True))
    more = f" and {len(holes) - SAID} times more" if len(holes) > SAID else ""
    text = (
        f"nothing at all was recorded for {said}{more}; {LEFT:g} s of it is kept, all later times are earlier by the "
        "rest, and both sides are used"
    )
    notice = Notice("recording", "clock", len(holes), text)
    notices = [*recording.notices, notice]
    return replace(recording, streams=streams, goal=goal, left_out=left_out, notices=notices, shortened=True)


def _moved(stream: Stream, holes: LongHoles) -> Stream:
    return replace(stream, times=holes.shortened(stream.times))
