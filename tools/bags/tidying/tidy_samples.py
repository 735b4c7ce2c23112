# SPDX-License-Identifier: BSD-3-Clause
"""One stream tidied up by itself, before the robot is known: order, glitches, second publishers, staircases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.time_order import in_time_order
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.glitches import without_glitches
from jointscope.tools.bags.tidying.late_copies import without_late_copies
from jointscope.tools.bags.tidying.not_finite import MOST, absent_in, filled_in, numbers_only
from jointscope.tools.bags.tidying.second_publisher import without_second_publisher
from jointscope.tools.bags.tidying.staircase import without_repetitions

FEWEST = 30  # samples that tell anything


def ordered_samples(name: str, samples: TimedSamples) -> TimedSamples:
    """The samples in the order of their stamps, without late copies, whatever is no number as NaN.

    Args:
        name: of the stream.
        samples: on the clock of all streams, in the order of the bag; NaN may be among them.

    Raises:
        RecordingError: the clock cannot be trusted.
    """
    samples, _ = without_late_copies(name, in_time_order(name, samples)[0])
    return replace(samples, values=numbers_only(samples.values))


def plausible_samples(name: str, samples: TimedSamples) -> TimedSamples:
    """Ordered samples of a sensor of any kind, without what no sensor says; commands may jump and repeat themselves.

    Args:
        name: of the stream.
        samples: in the order of their stamps; NaN may be among them, and stays in channels that are mostly NaN.

    Raises:
        RecordingError: so much would be left out that something else is wrong.
    """
    absent = absent_in(samples)
    missing = np.count_nonzero(np.isnan(samples.values) & ~absent, axis=0)
    sound = missing <= MOST * np.count_nonzero(~absent, axis=0)
    if not sound.any():
        return samples
    whole = filled_in(samples)
    filled = None if whole.filled is None else whole.filled[:, sound]
    seen = replace(whole, values=whole.values[:, sound], filled=filled)
    kept = cleaned_sensor(name, tuple(map(str, np.flatnonzero(sound))), seen)[0].stamps
    return replace(whole, values=np.where(sound, whole.values, samples.values)).take(np.isin(whole.stamps, kept))


def cleaned_sensor(
    name: str, channels: tuple[str, ...], samples: TimedSamples, wraps: float = 0.0
) -> tuple[TimedSamples, list[Notice]]:
    """Samples of a sensor without those of a second publisher, glitches and repetitions, and what was left out.

    Args:
        name: of the stream.
        channels: name of each column.
        samples: in the order of their stamps, finite, in the unit of the bag.
        wraps: period of the counter behind them, 0 for none.

    Raises:
        RecordingError: so much would be left out that something else is wrong.
    """
    if len(samples) < FEWEST:
        return samples, []
    samples, notices = without_second_publisher(name, channels, samples)
    samples, found = without_glitches(name, channels, samples, wraps)
    notices += found
    samples, found = without_repetitions(name, samples)
    return samples, notices + found
