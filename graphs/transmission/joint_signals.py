# SPDX-License-Identifier: BSD-3-Clause
"""What the joints did at the stamps of the motor encoders: deflection, angles, speeds, torque through the gear.

The link encoder is interpolated to the stamps of the motor encoder. Speeds are mean speeds over a window around each
stamp, which shifts nothing in time. Stamps next to a gap are left out: nobody knows what happened there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.joint_motion import window_mean
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

WINDOW = 0.02  # [s] over which speeds are means, if the samples are that dense
PERIODS = 3.0  # sampling periods in the window where they are not
GAP = 4.0  # mean sampling periods from which a pause between two samples is a gap
FEWEST = 100


@dataclass(frozen=True)
class JointSignals:
    """Signals of all joints at m instants.

    Attributes:
        times: shape (m,) [s].
        deflection: motor encoder - link encoder, shape (m, n) [rad]; with an unknown constant.
        q: angles of the links, shape (m, n) [rad].
        v: speeds of the links, shape (m, n) [rad/s].
        torque: through the gears towards the links, as measured, shape (m, n) [N m]; None where nothing measures it.
    """

    times: Array
    deflection: Array
    q: Array
    v: Array
    torque: Array | None


def joint_signals(recording: Recording, robot: Robot) -> JointSignals:
    """The signals of a recording.

    Raises:
        RecordingError: hardly any instants lie within all streams and outside of gaps.
    """
    link = link_stream(recording, robot)
    motor = recording.streams[robot.motor_encoder.name]
    torque = torque_stream(recording, robot)
    window = speed_window(link)
    others = [link] if torque is None else [link, torque]
    inside = (motor.times >= link.times[0] + window / 2) & (motor.times <= link.times[-1] - window / 2)
    inside &= np.all([away_from_gaps(stream, motor.times, window) for stream in others], axis=0)
    inside &= recording.are_judged(motor.times)
    times = motor.times[inside]
    if len(times) < FEWEST:
        raise RecordingError(
            f"{recording.path}: motor and link encoders have {len(times)} samples in common; expected at least "
            f"{FEWEST}: check that both are stamped by the same clock"
        )
    q = at(link, times) - np.asarray(_zero_of_links(robot))
    v = (at(link, times + window / 2) - at(link, times - window / 2)) / window
    deflection = motor.values[inside] - robot.motor_encoder.zero - q
    return JointSignals(times, deflection, q, v, None if torque is None else at(torque, times))


def link_stream(recording: Recording, robot: Robot) -> Stream:
    """The stream of the link encoders, which a robot with free links has."""
    assert robot.link_encoder is not None
    return recording.streams[robot.link_encoder.name]


def torque_stream(recording: Recording, robot: Robot) -> Stream | None:
    """What measures the torque through the gears: a sensor in the joint, else the torque of the motor."""
    if robot.torque_sensor is not None:
        return recording.streams[robot.torque_sensor.name]
    return recording.command if robot.command.unit == "N m" else None


def speed_window(stream: Stream) -> float:
    """Time over which speeds are means [s]."""
    return max(WINDOW, PERIODS * period(stream))


def at(stream: Stream, times: Array) -> Array:
    """Linear interpolation, shape (m, c)."""
    return np.column_stack([np.interp(times, stream.times, column) for column in stream.values.T])


def mean_at(stream: Stream, times: Array, window: float) -> Array:
    """Mean of a stream around each instant, shape (m, c)."""
    return window_mean(stream, times, window)


def away_from_gaps(stream: Stream, times: Array, window: float) -> NDArray[np.bool_]:
    """Whether the window around each instant holds no gap of the stream, shape (m,)."""
    spacing = np.diff(stream.times)
    gaps = np.flatnonzero(spacing > GAP * period(stream))
    good = np.ones(len(times), dtype=bool)
    for k in gaps:
        good &= (times + window / 2 <= stream.times[k]) | (times - window / 2 >= stream.times[k + 1])
    return good


def period(stream: Stream) -> float:
    """Mean time from sample to sample; the median would be fooled by packets that arrive in bursts."""
    return float(stream.times[-1] - stream.times[0]) / max(len(stream) - 1, 1)


def _zero_of_links(robot: Robot) -> Array:
    assert robot.link_encoder is not None
    return robot.link_encoder.zero
