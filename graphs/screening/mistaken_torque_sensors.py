# SPDX-License-Identifier: BSD-3-Clause
"""Torque sensors of elastic joints that are exchanged, count backwards, have another unit or are late: the drives tell.

Whatever the spring behind it is, the motor of a joint obeys

    tau_spring = k u - I a_motor - d v_motor - mu sign(v_motor) - offset

so a channel is a linear combination of its own drive's signals: it fits those of one joint alone, its sign is that of
-I, and it fits at the right time. Its size is compared with the torque that rigid links need.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.screening.drive_channels import CLEARLY, DriveChannels, belongs_to, thousands
from jointscope.graphs.screening.windowed_motion import faded_mean, windowed_motion
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import TorqueSensor
from jointscope.robots.recordings.recording import Notice, Recording, Stream

Array = NDArray[np.float64]

MISTAKEN_TORQUE = "torque"  # kind of its notices
WINDOW, PERIODS = 0.01, 3.0  # [s], [periods] of the slowest stream: a window is as long as the longer one
LINK_WINDOW = 0.1  # [s] long against what springs swing
LOOKS = ("looks like N mm beside what its links need", "looks like kN m beside what its links need")
INSTANTS, FEWEST = 1500, 100
FITS = 0.3  # of a channel that its drive may leave
BOTH = 1.5  # times what a late sensor leaves: a late command that leaves no more explains it, too
REVERSAL = 0.02  # [rad/s] within which dry friction turns over
LAGS = np.arange(-30, 31) * 1e-3  # [s]
SHORTEST_LAG = 0.003  # [s]


def mistaken_torque_sensors(recording: Recording, robot: Robot) -> list[Notice]:
    """What is wrong with the torque sensor, with what to write; nothing where it is right, or the drives do not tell.

    Args:
        recording: what was measured.
        robot: as its file has it.
    """
    sensor = robot.torque_sensor
    if sensor is None:
        return []
    robot = robot.in_posture(recording.posture)
    streams = (recording.streams[name] for name in (robot.motor_encoder.name, "command", sensor.name))
    drives = _Drives.of(*streams)
    if drives is None:
        return []
    now = drives.at()
    left = np.array([[now.left(i, k) for i in range(robot.n)] for k in range(robot.n)])
    own, channels_of = belongs_to(left, FITS), DriveChannels(robot, sensor, "torque")
    said = [channels_of.exchanged(own)] if np.any(own != np.arange(robot.n)) else []
    if all(left[k, joint] < FITS for k, joint in enumerate(own)):
        channels = np.argsort(own)  # of each joint
        scale = now.signs(channels) / _size(recording, robot, channels)
        if np.any(scale != 1.0):
            said.append(channels_of.scaled(scale, LOOKS))
        lag = drives.lag(channels)
        if lag:
            said.append(_out_of_time(robot, sensor, lag))
    return [Notice(sensor.name, MISTAKEN_TORQUE, 0, text) for text in said]


@dataclass(frozen=True)
class _Drives:
    """Signals of all drives at some instants, and the streams of which they are means in a window.

    Attributes:
        times: shape (m,) [s].
        window: [s].
        speed, acceleration: of the motors, shape (m, n).
        command, torque: the streams.
    """

    times: Array
    window: float
    speed: Array
    acceleration: Array
    command: Stream
    torque: Stream

    @staticmethod
    def of(encoder: Stream, command: Stream, torque: Stream) -> _Drives | None:
        """Where all three last; None where that is too short."""
        streams = (encoder, command, torque)
        period = max(float(np.max(s.periods)) for s in streams)
        window = max(WINDOW, PERIODS * period)
        margin = 1.5 * window + float(LAGS[-1])
        begin, end = max(s.times[0] for s in streams) + margin, min(s.times[-1] for s in streams) - margin
        if not np.isfinite(window) or end - begin < FEWEST * window / PERIODS:
            return None
        times = np.linspace(begin, end, INSTANTS)
        _, speed, acceleration = windowed_motion(encoder, times, window)
        return _Drives(times, window, speed, acceleration, command, torque)

    def at(self, late: float = 0.0, command_late: float = 0.0) -> _DriveSignals:
        """The signals where the sensor, or the command, is taken from another time [s]."""
        torque = faded_mean(self.torque, self.times + late, self.window)
        command = faded_mean(self.command, self.times + command_late, self.window)
        return _DriveSignals(self.speed, self.acceleration, command, torque)

    def lag(self, channels: NDArray[np.intp]) -> float:
        """How late the sensor is [s]; zero where it is in time, or a late command explains it as well."""

        def whole(late: float, command_late: float) -> float:
            there = self.at(late, command_late)
            shares = [there.left(joint, int(channel)) for joint, channel in enumerate(channels)]
            return float(np.sqrt(np.mean(np.square(shares))))

        now, coarse = whole(0.0, 0.0), [float(lag) for lag in LAGS[::3]]
        least, best = min((whole(lag, 0.0), lag) for lag in coarse)
        if best == 0.0 or least > now / 2.0:
            return 0.0
        near = (best + float(step) for step in (-2e-3, -1e-3, 0.0, 1e-3, 2e-3))
        left, lag = min((whole(lag, 0.0), lag) for lag in near)
        if abs(lag) < SHORTEST_LAG or left > now / CLEARLY:
            return 0.0
        return 0.0 if min(whole(0.0, other) for other in coarse) < BOTH * left else lag


@dataclass(frozen=True)
class _DriveSignals:
    """Signals of all drives at some instants: of the motors, of the command, and channels of the sensor.

    Attributes:
        speed, acceleration, command, torque: shape (m, n).
    """

    speed: Array
    acceleration: Array
    command: Array
    torque: Array

    def left(self, joint: int, channel: int) -> float:
        """Root mean square share of a channel that the drive of a joint leaves."""
        return _left(*self._fit(joint, channel))

    def signs(self, channels: NDArray[np.intp]) -> Array:
        """Sign of the channel of each joint: a motor's inertia resists, whichever way its command counts."""
        signs = np.ones(len(channels))
        for joint, channel in enumerate(channels):
            y, A, found = self._fit(joint, int(channel))
            inertia, share = found[1], np.std(A[:, 1] * found[1])
            seen = share > CLEARLY * _left(y, A, found) * np.std(A @ found)
            signs[joint] = -1.0 if inertia > 0.0 and seen and found[0] < 0.0 else 1.0
        return signs

    def _fit(self, joint: int, channel: int) -> tuple[Array, Array, Array]:
        """A channel, signals of a drive, shape (m, 5), and their factors."""
        y, u = self.torque[:, channel], self.command[:, joint]
        v, a = self.speed[:, joint], self.acceleration[:, joint]
        A = np.column_stack([u, a, v, np.tanh(v / REVERSAL), np.ones(len(v))])
        return y, A, np.linalg.lstsq(A, y, rcond=None)[0]


def _left(y: Array, A: Array, found: Array) -> float:
    """Root mean square share that a fit leaves."""
    size = float(np.std(y))
    return float(np.std(y - A @ found)) / size if size > 0.0 else np.inf


def _size(recording: Recording, robot: Robot, channels: NDArray[np.intp]) -> Array:
    """By which power of a thousand the channel of each joint is larger than the torque that rigid links need."""
    assert robot.torque_sensor is not None
    sizes = np.ones(robot.n)
    encoder, torque = recording.streams[robot.motor_encoder.name], recording.streams[robot.torque_sensor.name]
    begin, end = max(encoder.times[0], torque.times[0]), min(encoder.times[-1], torque.times[-1])
    margin = 1.5 * LINK_WINDOW
    if robot.free_links or end - begin < 4.0 * margin:
        return sizes
    times = np.linspace(begin + margin, end - margin, INSTANTS)
    q, v, a = windowed_motion(encoder, times, LINK_WINDOW)
    needed = robot.tree.torque(q - robot.motor_encoder.zero, v, a)
    seen = np.std(faded_mean(torque, times, LINK_WINDOW)[:, channels], axis=0)
    for joint, ratio in enumerate(seen / np.maximum(np.std(needed, axis=0), 1e-300)):
        sizes[joint] = 1.0 / thousands(float(ratio))
    return sizes


def _out_of_time(robot: Robot, sensor: TorqueSensor, lag: float) -> str:
    return (
        f"{sensor.name} is about {abs(1e3 * lag):.0f} ms {'late' if lag > 0.0 else 'early'} against positions and "
        "commands: so the drives explain it; correct its stamps or take those of its driver, or leave "
        f"sensors.{sensor.name} out of {robot_argument(robot)}"
    )
