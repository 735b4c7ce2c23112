# SPDX-License-Identifier: BSD-3-Clause
"""Stamps of one clock for all streams: unfilled ones left out, steps of clocks and foreign clocks taken back.

Streams without stamps, and those whose stamps nobody filled, are placed by their times of reception.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.clock_steps import on_one_clock
from jointscope.tools.bags.clocks.empty_stamps import empty_stamps
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.clocks.two_clocks import brought_together
from jointscope.tools.bags.clocks.unfilled_stamps import without_unfilled
from jointscope.tools.bags.clocks.unstamped import NO_STAMP, sent_earlier


def on_one_time_axis(
    streams: Mapping[str, TimedSamples], stamped: Collection[str]
) -> tuple[dict[str, TimedSamples], list[tuple[int, int]], list[Notice]]:
    """All streams with stamps of one clock that was never set.

    Args:
        streams: by name, in the order of the bag.
        stamped: names of those whose messages carry stamps; the others are stamped by their reception.

    Returns:
        The streams in the order of the bag, seams (begin, end) where the clock was set [ns], and what was done.
    """
    notices = list[Notice]()
    told, why = dict[str, TimedSamples](), dict[str, str]()
    for name, samples in streams.items():
        reason = empty_stamps(samples) if name in stamped else NO_STAMP
        if reason:
            why[name] = reason
            continue
        told[name], found = without_unfilled(name, samples)
        notices += found
    told, seams, found = on_one_clock(told)
    notices += found
    told, found = brought_together(told)
    notices += found
    moved = dict(told)
    for name, reason in why.items():
        samples = streams[name]
        moved[name], notice = sent_earlier(name, samples.stamped(samples.received), told, reason)
        notices.append(notice)
    return {name: moved[name] for name in streams}, seams, notices
