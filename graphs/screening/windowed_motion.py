# SPDX-License-Identifier: BSD-3-Clause
"""Signals and the motion of joints as means in windows whose edges fade: what is differentiated is hardly noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.joint_motion import window_mean
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

PARTS = (-0.5, -0.25, 0.0, 0.25, 0.5)  # of a window by which another one, of the same length, is shifted


class WindowedMotion(NamedTuple):
    """Positions [rad], speeds [rad/s] and accelerations [rad/s^2] of joints at some instants, shape (m, n) each."""

    q: Array
    v: Array
    a: Array


def faded_mean(stream: Stream, times: Array, window: float) -> Array:
    """Mean in two windows after one another, shape (m, k), around instants of shape (m,) [s]."""
    return np.mean([window_mean(stream, times + part * window, window) for part in PARTS], axis=0)


def windowed_motion(encoder: Stream, times: Array, window: float) -> WindowedMotion:
    """The motion that an encoder stream shows at some instants, shape (m,) [s]."""
    at = {part: faded_mean(encoder, times + part * window, window) for part in (-1.0, -0.5, 0.0, 0.5, 1.0)}
    return WindowedMotion(at[0.0], (at[0.5] - at[-0.5]) / window, (at[1.0] - 2.0 * at[0.0] + at[-1.0]) / window**2)
