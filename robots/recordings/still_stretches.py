# SPDX-License-Identifier: BSD-3-Clause
"""Stretches of a recording in which all motors stand: their encoders stay within their noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]
WITHIN = 6.0  # [sigma] that the readings of something at rest lie apart
SHORTEST = 0.5  # [s] of a stretch that is a rest
LONG_PAUSE = 0.5  # [s] without a sample
OFTEN = 0.25  # part of the time that motors stand in a recording of rests


def standing_share(recording: Recording, robot: Robot) -> float:
    """Part of a recording in which all motors stand."""
    return share_of(standing(recording, robot), recording.streams[robot.motor_encoder.name].times)


def share_of(stretches: Sequence[tuple[float, float]], times: Array) -> float:
    """Part of the time from the first sample to the last that stretches fill."""
    return float(sum(t1 - t0 for t0, t1 in stretches)) / max(float(np.ptp(times)), 1e-9)


def standing(recording: Recording, robot: Robot) -> list[tuple[float, float]]:
    """Stretches in which all motors stand [s]."""
    motor = robot.motor_encoder
    stream = recording.streams[motor.name]
    return still_stretches(stream.times, stream.values - motor.zero, WITHIN * motor.sigmas)


def still_stretches(times: Array, values: Array, within: Array) -> list[tuple[float, float]]:
    """Longest stretches in which every channel stays within a range [s].

    Args:
        times: shape (k,) [s].
        values: shape (k, c).
        within: of each channel, shape (c,).
    """
    from jointscope.robots.recordings.still_kernel import ends_of_stretches  # numba takes half a second to import

    ends = ends_of_stretches(*(np.ascontiguousarray(part) for part in (times, values, within)), LONG_PAUSE)
    starts = np.append(0, ends[:-1])
    long = times[ends - 1] - times[starts] >= SHORTEST
    return [(float(a), float(b)) for a, b in zip(times[starts[long]], times[ends[long] - 1], strict=True)]
