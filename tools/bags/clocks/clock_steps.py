# SPDX-License-Identifier: BSD-3-Clause
"""A clock that was set while the bag was recorded: the stamps jump, the times of reception go on.

    latency = received - stamp     jumps by the size of the step and stays there

The stamps on the shorter side are moved by the jump of the median latency, which is known to a fraction of the jitter
of reception. Streams that were stamped by the same clock jump together and are moved by the same amount; no equation
of motion is asked to hold across the seam.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import duration
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

SMALLEST_FORWARD, SMALLEST_BACK = 0.1, 0.02  # [s] lost messages and a queue that empties look like small steps forward
PERIODS = 5.0  # a step is longer than so many periods
WINDOW = 50  # messages on either side that tell the latency
AGREE = 0.2  # of the step: the latency must jump as the stamps do
SAME_MOMENT, SAME_STEP = 1.0, 0.05  # [s] of two streams of one clock
LONGEST = 4.3e9  # [s] what 32 bits of seconds can count, from 1970 to 2106
SEAM = 0.01  # [s] around the moment in which nothing is asked to hold


@dataclass(frozen=True)
class ClockStep:
    """One time at which a clock was set.

    Attributes:
        row: first message with the new clock, in the order of the bag.
        received: when it was written [ns].
        size: how far the stamps jumped ahead [s].
    """

    row: int
    received: int
    size: float


def clock_steps(samples: TimedSamples) -> list[ClockStep]:
    """Where the clock behind the stamps was set, in the order of the bag."""
    if len(samples) < 4 or not samples.reception_tells:
        return []
    stamp_steps, received_steps = np.diff(samples.stamps) / 1e9, np.diff(samples.received) / 1e9
    period = float(np.median(np.abs(stamp_steps)))
    allowed = np.where(stamp_steps < 0, SMALLEST_BACK, SMALLEST_FORWARD)
    allowed = np.maximum(allowed, PERIODS * period)
    odd = (stamp_steps < 0) | (stamp_steps > allowed)
    latency = samples.latency
    found: list[ClockStep] = []
    begin = 0
    for k in np.flatnonzero(odd & (np.abs(stamp_steps - received_steps) > allowed)) + 1:
        before, after = latency[max(begin, k - WINDOW) : k], latency[k : k + WINDOW]
        size = float(np.median(before) - np.median(after)) if len(before) else 0.0
        jump = float(stamp_steps[k - 1] - received_steps[k - 1])
        steady = float(np.median(np.abs(after - np.median(after)))) < 0.1 * abs(size)
        if abs(size) > allowed[k - 1] and abs(jump - size) < AGREE * abs(size) and steady and len(after) > 2:
            found.append(ClockStep(int(k), int(samples.received[k]), size))
            begin = int(k)
    return found


def on_one_clock(
    streams: Mapping[str, TimedSamples],
) -> tuple[dict[str, TimedSamples], list[tuple[int, int]], list[Notice]]:
    """All streams with the clock of their longest part.

    Args:
        streams: by name, in the order of the bag.

    Returns:
        The streams, seams (begin, end) in the new stamps [ns], and what was done.
    """
    steps = {name: clock_steps(samples) for name, samples in streams.items()}
    every = [step for found in steps.values() for step in found]
    moved, seams, notices = dict(streams), [], []
    for name, found in steps.items():
        if not found:
            continue
        sizes = [_shared_size(step, every) for step in found]
        samples = streams[name]
        edges = [0, *(step.row for step in found), len(samples)]
        ahead = np.concatenate([[0.0], np.cumsum(sizes)])
        ahead -= ahead[int(np.argmax(np.diff(edges)))]
        if np.abs(ahead).max() > LONGEST:
            continue  # no clock was ever set by so much: these are no times
        stamps = samples.stamps - np.repeat(np.rint(1e9 * ahead).astype(np.int64), np.diff(edges))
        moved[name] = samples.stamped(stamps)
        for step, size in zip(found, sizes, strict=True):
            at = int(stamps[step.row])
            seams.append((min(int(stamps[step.row - 1]), at) - int(SEAM * 1e9), at + int(SEAM * 1e9)))
            text = (
                f"{name}: its clock was set {'forward' if size > 0 else 'back'} by {duration(size)} at message "
                f"{step.row}, while messages came in as before; the parts were brought together by their times of "
                "reception"
            )
            notices.append(Notice(name, "clock", 1, text))
    return moved, seams, notices


def _shared_size(step: ClockStep, every: list[ClockStep]) -> float:
    """The size of a step by all streams that jumped with it [s]."""
    same = [
        other.size
        for other in every
        if abs(other.received - step.received) < SAME_MOMENT * 1e9 and abs(other.size - step.size) < SAME_STEP
    ]
    return float(np.median(same))
