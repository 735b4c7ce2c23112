# SPDX-License-Identifier: BSD-3-Clause
"""Headers whose stamps no driver filled: zero, all the same, whole seconds, or far coarser than the messages.

Such messages carry no stamp.
"""

from __future__ import annotations

import numpy as np

from jointscope.tools.bags.clocks.timed_samples import TimedSamples

ONE_SECOND = 1_000_000_000  # [ns]
SHARED = 3.0  # messages per stamp from which stamps are no times of theirs
MOST_ZERO = 0.5  # share of the messages


def empty_stamps(samples: TimedSamples) -> str:
    """What is wrong with all stamps of a stream; empty where they may be times, or where nothing stands in for them."""
    if len(samples) < 2 or not _came_in_one_by_one(samples):
        return ""
    stamps = samples.stamps
    if np.all(stamps == stamps[0]):
        return f"all its stamps are {'zero' if stamps[0] == 0 else f'{stamps[0] / 1e9:.3f} s'}"
    zero = int(np.count_nonzero(stamps == 0))
    if zero > MOST_ZERO * len(stamps):
        return f"its stamps are zero in {zero} of {len(stamps)} messages"
    different = len(np.unique(stamps))
    if len(stamps) <= SHARED * different:
        return ""
    if np.all(stamps % ONE_SECOND == 0):
        return "its stamps hold whole seconds only"
    return f"it has {different} stamps for {len(stamps)} messages"


def _came_in_one_by_one(samples: TimedSamples) -> bool:
    """Whether the times of writing are times: a recorder that copied the stamps has no others."""
    steps = np.diff(samples.received)
    return bool(np.all(steps >= 0) and np.median(steps) > 0)
