# SPDX-License-Identifier: BSD-3-Clause
"""Incremental encoders on motors count from where they were switched on; encoders on the links tell where that was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.robots.dynamics.transmission import motor_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


def with_motor_zero(recording: Recording, robot: Robot) -> Recording:
    """The recording with motor angles that agree with the links' but for deflections, if their zero is not known.

    Args:
        recording: the data.
        robot: says whether the zero is known.
    """
    encoder, other = robot.motor_encoder, robot.link_encoder
    if encoder.zero_known or other is None:
        return recording
    motor, link = recording.streams[encoder.name], recording.streams[other.name]
    if not len(motor) or not len(link):
        return recording
    at_links = np.column_stack([np.interp(motor.times, link.times, column) for column in (link.values - other.zero).T])
    angles = motor_angles(robot, at_links)
    shifted = replace(motor, values=motor.values - np.median(motor.values - angles, axis=0))
    return replace(recording, streams={**recording.streams, encoder.name: shifted})
