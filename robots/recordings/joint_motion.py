# SPDX-License-Identifier: BSD-3-Clause
"""Angles and smoothed speeds of the joints from their motor encoders, for judging a recording, not for estimating."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

WINDOW = 0.03  # [s] long enough to average quantization away, short against the motion
MOST_POINTS = 3000


@dataclass(frozen=True)
class JointMotion:
    """The motion at some instants.

    Attributes:
        times: shape (m,) [s].
        window: time over which a speed is the mean [s].
        q: angles, shape (m, n) [rad].
        v: mean speeds in the window around each instant, shape (m, n) [rad/s].
    """

    times: Array
    window: float
    q: Array
    v: Array


def joint_motion(encoder: Stream, zero: Array) -> JointMotion:
    """The motion that an encoder stream shows.

    Args:
        encoder: stream of the motor encoders [rad].
        zero: readings at angle zero, shape (n,) [rad].
    """
    times = encoder.times
    window = min(max(WINDOW, 3.0 * float(np.max(encoder.periods))), float(times[-1] - times[0]) / 3.0)
    count = min(MOST_POINTS, len(times))
    instants = np.linspace(times[0] + window / 2, times[-1] - window / 2, count)
    before, middle, after = (
        np.column_stack([np.interp(instants + shift, times, angle) for angle in encoder.values.T])
        for shift in (-window / 2, 0.0, window / 2)
    )
    return JointMotion(instants, window, middle - zero, (after - before) / window)


def window_mean(stream: Stream, times: Array, window: float) -> Array:
    """Mean of a stream in a window around each instant, shape (m, k), for instants of shape (m,) [s]."""
    steps = np.diff(stream.times)[:, None] * (stream.values[1:] + stream.values[:-1]) / 2.0
    integral = np.vstack([np.zeros(stream.values.shape[1]), np.cumsum(steps, axis=0)])
    columns = []
    for column in integral.T:
        after, before = (np.interp(times + shift, stream.times, column) for shift in (window / 2, -window / 2))
        columns.append((after - before) / window)
    return np.column_stack(columns)
