# SPDX-License-Identifier: BSD-3-Clause
"""Joints of one message that were sampled at different instants, each with stamps of its own in another stream.

Drives on a bus answer one after the other, and the message that gathers their answers has a single stamp. Where another
sensor of the same drive is stamped by itself, message by message, its stamps tell when the joint was sampled; the
values of the joint are then interpolated to the stamps of the message.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.parts.sensors import BY_MESSAGE
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.time_order import LATE_ALLOWED

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


def at_message_stamps(
    name: str, stamped_by: Sequence[str], stamps: Stamps, values: Array, others: Mapping[str, Stamps | None]
) -> tuple[Array, list[Notice]]:
    """Values at the stamps of their messages, shape (n, m), and what was done; at least one joint has other stamps.

    Args:
        name: of the stream.
        stamped_by: sensor that has the stamps of each joint, or BY_MESSAGE, m texts.
        stamps: of the messages, in the order of the bag, shape (n,) [ns].
        values: shape (n, m).
        others: stamps of other sensors, in the order of the bag [ns]; None for one without.

    Raises:
        RecordingError: a sensor has no stamps, another number of them, or another clock.
    """
    values, skews = values.copy(), dict[str, Stamps]()
    for j, sensor in enumerate(stamped_by):
        if sensor == BY_MESSAGE:
            continue
        skew = skews[sensor] = _skew(name, sensor, stamps, others[sensor])
        order = np.argsort(stamps + skew, kind="stable")
        since = (stamps - stamps[0]) / 1e9
        values[:, j] = np.interp(since, (since + skew / 1e9)[order], values[order, j])
    apart = ", ".join(f"{sensor} {np.std(skew) / 1e6:.2g} ms" for sensor, skew in skews.items())
    text = f"{name}: samples taken beside the stamp of their message, by the stamps of {apart} (rms); interpolated"
    return values, [Notice(name, "info", len(stamps), text)]


def _skew(name: str, sensor: str, stamps: Stamps, own: Stamps | None) -> Stamps:
    """How much later than its message each sample was taken, shape (n,) [ns]."""
    place = f"{name}: stamped_by {sensor}"
    if own is None:
        raise RecordingError(f"{place}: its messages carry no stamp; expected header.stamp")
    if len(own) != len(stamps):
        raise RecordingError(
            f"{place}: {len(stamps)} messages, but {len(own)} of {sensor}; expected one for one: messages were "
            "lost, or another sensor belongs to this joint"
        )
    skew = own - stamps
    typical = abs(float(np.median(skew))) / 1e9
    if typical > LATE_ALLOWED:
        raise RecordingError(
            f"{place}: its stamps are {typical:.3g} s from those of the messages; expected at most {LATE_ALLOWED:g} s: "
            "two clocks, which must be brought together before"
        )
    return skew
