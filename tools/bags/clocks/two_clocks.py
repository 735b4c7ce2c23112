# SPDX-License-Identifier: BSD-3-Clause
"""Streams that were stamped by different clocks: hours apart, although their messages came in together.

The typical latency of a stream (received - stamp) is that of its transport. A stream whose latency differs from that of
most others by far more than any transport takes is stamped by another clock, and is moved by the difference.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import duration
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

APART = 0.5  # [s] no transport takes so much longer than another
TOGETHER = 0.9  # of the span in which a stream came in, its stamps must span too


def brought_together(streams: Mapping[str, TimedSamples]) -> tuple[dict[str, TimedSamples], list[Notice]]:
    """All streams on the clock of most of them.

    Args:
        streams: those that carry stamps, by name.

    Returns:
        The streams, and what was done.
    """
    typical = {name: float(np.median(s.latency)) for name, s in streams.items() if _can_tell(s)}
    if len(typical) < 2:
        return dict(streams), []
    reference = _most_common(list(typical.values()))
    moved, notices = dict(streams), []
    for name, latency in typical.items():
        apart = latency - reference
        if abs(apart) <= APART:
            continue
        samples = streams[name]
        moved[name] = samples.stamped(samples.stamps + round(1e9 * apart))
        text = (
            f"{name}: its stamps are {duration(apart)} {'behind' if apart > 0 else 'ahead of'} those of the other "
            "streams, whose messages came in at the same time: two clocks; they were brought together by the times of "
            "reception, which is good to about a millisecond; synchronise the clocks (chrony, PTP) for better results"
        )
        notices.append(Notice(name, "clock", len(samples), text))
    return moved, notices


def _can_tell(samples: TimedSamples) -> bool:
    if len(samples) < 2 or not samples.reception_tells:
        return False
    stamped, received = np.ptp(samples.stamps), np.ptp(samples.received)
    return bool(TOGETHER * received < stamped < received / TOGETHER)


def _most_common(latencies: list[float]) -> float:
    """The latency that most streams share; of equal numbers the smallest positive one."""
    counts = [sum(abs(other - one) <= APART for other in latencies) for one in latencies]
    best = [one for one, count in zip(latencies, counts, strict=True) if count == max(counts)]
    return min(best, key=lambda one: (one < 0, abs(one)))
