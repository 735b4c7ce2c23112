# SPDX-License-Identifier: BSD-3-Clause
"""Headers whose stamps no driver filled: all zero, all the same, or whole seconds. Such messages carry no stamp."""

from __future__ import annotations

import numpy as np

from jointscope.tools.bags.clocks.timed_samples import TimedSamples

ONE_SECOND = 1_000_000_000  # [ns]
SHARED = 3.0  # messages per stamp from which whole seconds are a field that was left out


def empty_stamps(samples: TimedSamples) -> str:
    """What is wrong with all stamps of a stream; empty where they may be times, or where nothing stands in for them."""
    if len(samples) < 2 or not _came_in_one_by_one(samples):
        return ""
    stamps = samples.stamps
    if np.all(stamps == stamps[0]):
        return f"all its stamps are {'zero' if stamps[0] == 0 else f'{stamps[0] / 1e9:.3f} s'}"
    if np.all(stamps % ONE_SECOND == 0) and len(stamps) > SHARED * len(np.unique(stamps)):
        return "its stamps hold whole seconds only"
    return ""


def _came_in_one_by_one(samples: TimedSamples) -> bool:
    """Whether the times of writing are times: a recorder that copied the stamps has no others."""
    steps = np.diff(samples.received)
    return bool(np.all(steps >= 0) and np.median(steps) > 0)
