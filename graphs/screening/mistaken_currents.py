# SPDX-License-Identifier: BSD-3-Clause
"""Measured currents that are exchanged, count backwards or have another unit: their drives tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from jointscope.graphs.screening.current_delay import FITS, current_gap, tried_delays
from jointscope.graphs.screening.drive_currents import DriveCurrents
from jointscope.graphs.screening.exchanged_joints import names_or_places
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.recordings.recording import Notice, Recording

Array = NDArray[np.float64]

MISTAKEN_CURRENT = "current"  # kind of its notices
CLEARLY = 3.0  # times less that another drive must leave
LITTLE = 0.7  # of a channel's standard deviation: where a drive leaves more it explains next to nothing
NOISE = 3.0  # times its noise that must be left, too
SMOOTHINGS = (2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 32.0)  # steps of the commands, time constants that are tried
AGES = 8  # steps of delay that are tried with them
THOUSAND, NEAR = 1000.0, 2.4  # between A and mA, and how far a ratio may be from it


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
    own = np.arange(robot.n)
    exchanged = _belongs_to(_shares(drives, sensor.delay))
    gap = current_gap(robot, [recording])
    late = sensor.delay if gap is None or np.any(exchanged != own) else gap.start
    fits = [drives.fit(j, k, late, late) for j, k in enumerate(np.argsort(exchanged).tolist())]
    said = [] if gap is not None or np.any(exchanged != own) else _unexplained(robot, sensor, drives)
    said += [] if said or np.any(exchanged != own) else _smoothed(robot, sensor, drives)
    said += [_exchanged(robot, sensor, exchanged)] if np.any(exchanged != own) else []
    if all(fit.share < FITS for fit in fits):
        factors = np.array([_factor(robot, sensor, j, fit.by_command) for j, fit in enumerate(fits)])
        if np.any(factors != 1.0):
            said.append(_scaled(robot, sensor, factors))
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
    best = int(np.argmin(np.sum(np.log(np.maximum(shares, 1e-12)), axis=1)))
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
    u, v = (lfilter([1.0 - keep], [1.0, -keep], signal, axis=0) for signal in (drives.u, drives.v))
    return replace(drives, u=np.asarray(u), v=np.asarray(v))


def _shares(drives: DriveCurrents, late: float) -> Array:
    """What the drive of each joint leaves of each channel, shape (channels, joints)."""
    return np.array([[drives.fit(j, k, late, late).share for j in range(drives.n)] for k in range(drives.n)])


def _belongs_to(left: Array) -> NDArray[np.intp]:
    """Joint of each channel: another one than its own where it fits clearly better, all of them together."""
    own = np.arange(len(left))
    best = np.argmin(left, axis=1)
    better = left[own, best] < left[own, own] / CLEARLY
    return best if sorted(best) == list(own) and bool(np.all(better[best != own])) else own


def _factor(robot: Robot, sensor: MotorCurrent, j: int, by_command: float) -> float:
    """What the values of a joint are to be multiplied by: a sign, and a thousand where the unit is another one."""
    joint = robot.joints[j]
    gain = 1.0 if robot.drive_gain is None else robot.drive_parameter(joint, robot.drive_gain).prior
    constant = robot.parameters.get(sensor.torque_per_ampere(joint))
    expected = robot.command_volts * (gain / constant.prior if constant is not None else 1.0)
    sign = -1.0 if by_command * expected < 0.0 else 1.0
    for factor in (THOUSAND, 1.0 / THOUSAND):
        if 1.0 / NEAR < abs(by_command / expected) * factor < NEAR:
            return sign * factor
    return sign


def _exchanged(robot: Robot, sensor: MotorCurrent, own: NDArray[np.intp]) -> str:
    names = names_or_places(sensor.source, robot.n)
    right = [names[channel] for channel in np.argsort(own)]
    wrong = [joint for k, joint in enumerate(robot.joints) if own[k] != k]
    return (
        f"{sensor.name}: currents of {' and '.join(wrong)} seem to be exchanged: so the drives explain them; if so, "
        f"write `names: [{', '.join(right)}]` in sensors.{sensor.name} of {robot_argument(robot)}"
    )


def _scaled(robot: Robot, sensor: MotorCurrent, factors: Array) -> str:
    wrong = ", ".join(joint for joint, factor in zip(robot.joints, factors, strict=True) if factor != 1.0)
    reasons = ["counts the other way than its drive"] if np.any(factors < 0.0) else []
    sizes = np.abs(factors)
    if np.any(sizes != 1.0):
        by = "a thousand times" if float(sizes[sizes != 1.0][0]) < 1.0 else "a thousandth of"
        reasons.append(f"is {by} what its command makes, as in another unit of A and mA")
    scale = ", ".join(f"{factor:.12g}" for factor in factors * np.asarray(sensor.source.scale or 1.0))
    return (
        f"{sensor.name}: current of {wrong} {' and '.join(reasons)}; if that is so, write `scale: [{scale}]` in "
        f"sensors.{sensor.name} of {robot_argument(robot)}"
    )
