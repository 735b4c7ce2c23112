# SPDX-License-Identifier: BSD-3-Clause
"""Measured currents that are exchanged, count backwards or have another unit: their drives tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from jointscope.graphs.screening.current_delay import FITS, current_gap, least_left, tried_delays
from jointscope.graphs.screening.drive_channels import CLEARLY, DriveChannels, belongs_to, thousands
from jointscope.graphs.screening.drive_currents import DriveCurrents
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.recordings.recording import Notice, Recording

Array = NDArray[np.float64]

MISTAKEN_CURRENT = "current"  # kind of its notices
LITTLE = 0.7  # of a channel's standard deviation: where a drive leaves more it explains next to nothing
NOISE = 3.0  # times its noise that must be left, too
SMOOTHINGS = (2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 32.0)  # steps of the commands, time constants that are tried
AGES = 8  # steps of delay that are tried with them
LOOKS = (
    "is a thousand times what its command makes, as in another unit of A and mA",
    "is a thousandth of what its command makes, as in another unit of A and mA",
)


def mistaken_currents(recording: Recording, robot: Robot) -> list[Notice]:
    """What is wrong with the sensor, with what to write; nothing where it is right, or where drives do not tell.

    Args:
        recording: what was measured.
        robot: as its file has it.
    """
    sensor = robot.motor_current
    drives = None if sensor is None else DriveCurrents.of(recording, robot)
    if sensor is None or drives is None:
        return []
    own, channels = belongs_to(_shares(drives, sensor.delay)), DriveChannels(robot, sensor, "current")
    if np.any(own != np.arange(robot.n)):
        said, late = [channels.exchanged(own)], sensor.delay
    else:
        gap = current_gap(robot, [recording])
        said = _unexplained(robot, sensor, drives) if gap is None else []
        said = said or _smoothed(robot, sensor, drives)
        late = sensor.delay if gap is None else gap.start
    fits = [drives.fit(j, k, late, late) for j, k in enumerate(np.argsort(own).tolist())]
    if all(fit.share < FITS for fit in fits):
        factors = np.array([_factor(robot, sensor, j, fit.by_command) for j, fit in enumerate(fits)])
        if np.any(factors != 1.0):
            said.append(channels.scaled(factors, LOOKS))
    return [Notice(sensor.name, MISTAKEN_CURRENT, 0, text) for text in said]


def _unexplained(robot: Robot, sensor: MotorCurrent, drives: DriveCurrents) -> list[str]:
    """Currents of which their drives explain next to nothing at any delay, while they are far more than noise."""
    tried, size = tried_delays(drives.h), np.std(drives.currents, axis=0)
    left = np.min([[drives.fit(j, j, late, late).share for j in range(drives.n)] for late in tried], axis=0)
    wrong = [j for j in range(robot.n) if left[j] > LITTLE and left[j] * size[j] > NOISE * sensor.sigmas[j]]
    if not wrong:
        return []
    joints, parts = (", ".join(each[j] for j in wrong) for each in (robot.joints, [f"{100.0 * x:.0f} %" for x in left]))
    return [
        f"{sensor.name}: commands and speeds of {joints} leave {parts} of their currents: these are of another joint, "
        f"stop, or are clipped or smoothed; look at {sensor.source.topic}, or remove sensors.{sensor.name} from "
        f"{robot_argument(robot)}"
    ]


def _smoothed(robot: Robot, sensor: MotorCurrent, drives: DriveCurrents) -> list[str]:
    """Currents that are clearly those of commands and speeds behind a low-pass, all of them."""

    def left(of: DriveCurrents) -> Array:
        tried = of.h * (np.arange(-1, AGES) + 0.5)
        return np.min([[of.fit(j, j, late, late).share for j in range(of.n)] for late in tried], axis=0)

    plain = left(drives)
    if np.any(plain * np.std(drives.currents, axis=0) < NOISE * sensor.sigmas):
        return []
    shares = np.array([left(_behind_low_pass(drives, steps)) for steps in SMOOTHINGS])
    best = least_left(shares)
    if np.any(shares[best] > plain / CLEARLY):
        return []
    return [
        f"{sensor.name}: the currents seem to be smoothed, over about {1e3 * SMOOTHINGS[best] * drives.h:.2g} ms: so "
        "commands and speeds explain them, and the model has no filter for currents; switch the drive's filter off, or "
        f"remove sensors.{sensor.name} from {robot_argument(robot)}"
    ]


def _behind_low_pass(drives: DriveCurrents, steps: float) -> DriveCurrents:
    """The same signals behind a first-order low-pass with so many steps as time constant."""
    keep = float(np.exp(-1.0 / steps))
    u, v = (lfilter([1.0 - keep], [1.0, -keep], signal, axis=0) for signal in (drives.timeline.u, drives.v))
    return replace(drives, timeline=replace(drives.timeline, u=np.asarray(u)), v=np.asarray(v))


def _shares(drives: DriveCurrents, late: float) -> Array:
    """What the drive of each joint leaves of each channel, shape (channels, joints)."""
    return np.array([[drives.fit(j, k, late, late).share for j in range(drives.n)] for k in range(drives.n)])


def _factor(robot: Robot, sensor: MotorCurrent, j: int, by_command: float) -> float:
    """What the values of a joint are to be multiplied by: a sign, and a thousand where the unit is another one."""
    joint = robot.joints[j]
    gain = 1.0 if robot.drive_gain is None else robot.drive_parameter(joint, robot.drive_gain).prior
    constant = robot.parameters.get(sensor.torque_per_ampere(joint))
    expected = robot.command_volts * (gain / constant.prior if constant is not None else 1.0)
    sign = -1.0 if by_command * expected < 0.0 else 1.0
    return sign * thousands(abs(by_command / expected))
