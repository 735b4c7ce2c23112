# SPDX-License-Identifier: BSD-3-Clause
"""Samples of one stream that lie alone, far before or behind all others, are none of the recording: a wild stamp."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted, duration
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.long_holes import LONGEST

FEW, SHARE = 3, 0.02  # samples, or share of their stream, that may be left out


def without_lone_samples(samples: Mapping[str, TimedSamples]) -> tuple[dict[str, TimedSamples], list[Notice]]:
    """The samples without the few of a stream that a long hole in all streams parts from everything else.

    Args:
        samples: of each stream, in the order of their stamps.
    """
    kept, notices = dict(samples), list[Notice]()
    while found := _lone(kept):
        name, first, after = found
        stamps = kept[name].stamps
        alone = np.arange(first, after)
        rest = np.delete(stamps, alone)
        distance = (rest[0] - stamps[after - 1] if first == 0 else stamps[first] - rest[-1]) / 1e9
        where = "before" if first == 0 else "after"
        text = (
            f"{name}: left out {counted(len(alone), 'sample')} whose stamp is {duration(float(distance))} {where} all "
            "others: it is wild"
        )
        notices.append(Notice(name, "dropped", len(alone), text))
        kept[name] = kept[name].take(~np.isin(np.arange(len(stamps)), alone))
    return kept, notices


def _lone(samples: Mapping[str, TimedSamples]) -> tuple[str, int, int] | None:
    """Name of a stream, and the first of its lone samples and the one after the last."""
    filled = {name: s.stamps for name, s in samples.items() if len(s.stamps)}
    if not filled:
        return None
    every = np.sort(np.concatenate(list(filled.values())))
    holes = np.flatnonzero(np.diff(every) > LONGEST * 1e9)
    for hole in holes:
        before = {name: int(np.searchsorted(stamps, every[hole], side="right")) for name, stamps in filled.items()}
        for early in (True, False):
            counts = {n: (k if early else len(filled[n]) - k) for n, k in before.items()}
            own = [name for name, count in counts.items() if count]
            if len(own) != 1 or len(filled) == 1:
                continue
            (name,) = own
            total, count = len(filled[name]), counts[name]
            if count <= max(FEW, SHARE * total) and count < total:
                return (name, 0, count) if early else (name, total - count, total)
    return None
