# SPDX-License-Identifier: BSD-3-Clause
"""Joints that give way: an encoder on the link says other positions than the one on the motor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

SURELY = 10.0  # times the noise of both encoders together
SMOOTH = 0.5  # of what is left, that neighbouring samples differ by at the most; stamps that jitter differ by all of it


def soft_joints(motor: Stream, links: Stream, sigmas: Array) -> NDArray[np.bool_]:
    """Which joints have deflections that are no noise or jitter, and no zero, scale or delay of an encoder, shape (n,).

    Args:
        motor: positions of the motors behind their gears, n columns.
        links: positions of the links, n columns.
        sigmas: noise of both encoders together, shape (n,) [rad or m].
    """
    inside = (motor.times > links.times[0]) & (motor.times < links.times[-1])
    soft = np.zeros(motor.values.shape[1], dtype=bool)
    if np.count_nonzero(inside) < 10:
        return soft
    at = motor.times[inside]
    for j, (q_motor, q_link) in enumerate(zip(motor.values[inside].T, links.values.T, strict=True)):
        difference = q_motor - np.interp(at, links.times, q_link)
        columns = np.column_stack([np.ones_like(at), q_motor, np.gradient(q_motor, at)])
        left = difference - columns @ np.linalg.lstsq(columns, difference)[0]
        size = np.sqrt(np.mean(left**2))
        soft[j] = size > SURELY * sigmas[j] and np.sqrt(0.5 * np.mean(np.diff(left) ** 2)) < SMOOTH * size
    return soft
