# SPDX-License-Identifier: BSD-3-Clause
"""Where motor encoders stand when the links are at zero, told by the encoders of the links.

What lies between motor and link deflects, but not by the same angle all the time; a zero that was never set does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

CONSTANT = 10.0  # times that the difference must exceed its own scatter
TO_SIGMA = 1.4826  # of the median absolute deviation


def motor_zero(motor: Stream, links: Stream, sigmas: Array) -> Array:
    """Reading of each motor's encoder at zero, shape (n,) [rad or m]; zero where it cannot be told from deflection.

    Args:
        motor: positions of the motors behind their gears, n columns.
        links: positions of the links, n columns.
        sigmas: noise of the motors' encoders, shape (n,).
    """
    inside = (motor.times >= links.times[0]) & (motor.times <= links.times[-1])
    if not inside.any():
        return np.zeros(motor.values.shape[1])
    at = motor.times[inside]
    difference = motor.values[inside] - np.column_stack([np.interp(at, links.times, q) for q in links.values.T])
    zero = np.median(difference, axis=0)
    scatter = np.maximum(TO_SIGMA * np.median(np.abs(difference - zero), axis=0), sigmas)
    return np.where(np.abs(zero) > CONSTANT * scatter, zero, 0.0)
