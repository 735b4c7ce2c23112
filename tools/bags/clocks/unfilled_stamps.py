# SPDX-License-Identifier: BSD-3-Clause
"""Stamps that nobody filled, or that one message got wrong: such messages are left out where they are few.

A stamp of zero is a time only where the neighbours are near, as at the beginning of a simulation. A stamp that is far
from where the times of reception put it, while those before and after are not, belongs to no clock.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import counted, duration
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

NEAR = 1.0  # [s] a clock that starts at zero goes on within this
MOST_UNFILLED = 0.5  # share of the messages
WILD = 0.5  # [s] off its neighbours, by the time of reception
FEW_WILD, WILD_SHARE = 5, 0.01  # so many, or this share, may be wild
NEIGHBOURS = 25  # on either side


def without_unfilled(name: str, samples: TimedSamples) -> tuple[TimedSamples, list[Notice]]:
    """The samples whose stamps can be times, in the order of the bag; all of them where too few would stay."""
    zero = samples.stamps == 0
    others = samples.stamps[~zero]
    notices = []
    count = int(np.count_nonzero(zero))
    unfilled = count > 1 or (count == 1 and len(others) > 0 and np.abs(others).min() > NEAR * 1e9)
    if unfilled and count <= MOST_UNFILLED * len(samples):
        notices.append(_unfilled_notice(name, samples, zero))
        samples = samples.take(~zero)
    wild = _wild(samples)
    count = int(np.count_nonzero(wild))
    if 0 < count <= max(FEW_WILD, WILD_SHARE * len(samples)):
        k = int(np.argmax(wild))
        off = duration(float(samples.latency[k] - np.median(samples.latency)))
        text = f"{name}: left out {counted(count, 'message')} with impossible stamps (the first is {off} off)"
        notices.append(Notice(name, "dropped", count, text))
        samples = samples.take(~wild)
    return samples, notices


def _unfilled_notice(name: str, samples: TimedSamples, zero: NDArray[np.bool_]) -> Notice:
    count, first = int(np.count_nonzero(zero)), int(np.argmin(zero))
    where = "at the start" if zero[:first].all() and first == np.count_nonzero(zero) else "here and there"
    text = f"{name}: left out {counted(count, 'message')} {where} whose stamp is zero: the driver had not filled it"
    return Notice(name, "dropped", count, text)


def _wild(samples: TimedSamples) -> NDArray[np.bool_]:
    """Which stamps lie far from both neighbourhoods by the time of reception, shape (n,)."""
    n = len(samples)
    if n < 2 * NEIGHBOURS or not samples.reception_tells:
        return np.zeros(n, bool)
    latency = samples.latency
    if np.ptp(latency) <= WILD:  # the usual case, without a window around every sample
        return np.zeros(n, bool)
    suspects = np.flatnonzero(np.abs(latency - _running_median(latency)) > WILD)
    wild = np.zeros(n, bool)
    for k in suspects:
        around = [latency[max(k - NEIGHBOURS, 0) : k], latency[k + 1 : k + 1 + NEIGHBOURS]]
        wild[k] = all(len(part) == 0 or abs(latency[k] - np.median(part)) > WILD for part in around)
    return wild


def _running_median(values: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, size=2 * NEIGHBOURS + 1, mode="nearest"))
