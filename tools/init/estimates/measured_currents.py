# SPDX-License-Identifier: BSD-3-Clause
"""Whether efforts that motors report are their currents: so their commands and speeds explain them.

Of a motor on a voltage the current is a u - b v + c. Where that holds for all joints the efforts are a sensor, a second
witness of the torque. In which unit they are nothing says: amperes are assumed, and the torque of one is a parameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.screening.windowed_motion import windowed_motion
from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.estimates.drive_values import Drives
from jointscope.tools.init.estimates.measured_robot import role_stream
from jointscope.tools.init.streams.named_signal import Chosen
from jointscope.tools.init.streams.roles import Roles
from jointscope.tools.init.streams.sensor_noise import NoiseGuess, guess_each

Array = NDArray[np.float64]

VOLTAGES = ("V", "duty")  # units of commands whose motors lose current by their speed
FITS = 0.3  # of an effort's standard deviation that its drive may leave
WINDOW, PERIODS, SAMPLES, FEWEST = 0.01, 3.0, 4000, 200
LATEST = 0.03  # [s]


@dataclass(frozen=True)
class GuessedCurrents:
    """Currents of all motors.

    Attributes:
        chosen: where they are.
        noise: of each joint, in the unit of the bag.
        signs: which way they count beside the commands.
        per_ampere: torque that one unit makes, of each joint [N m].
        back_emf: current that a speed takes away, of each joint [A s/rad]; above zero.
        offset: what each reads without a current [A].
        lost: whether nothing tells the gain of a joint's drive, and so that.
        share: largest share that a drive leaves.
    """

    chosen: Chosen
    noise: tuple[NoiseGuess, ...]
    signs: tuple[float, ...]
    per_ampere: tuple[float, ...]
    back_emf: tuple[float, ...]
    offset: tuple[float, ...]
    lost: tuple[bool, ...]
    share: float


def guess_currents(roles: Roles, encoder: Stream, drive: Drives) -> GuessedCurrents | None:
    """Currents among what a bag holds; None where there are none, or where efforts are something else.

    Args:
        roles: which signal is what.
        encoder: positions of the motors [rad or m].
        drive: of the joints, and the unit of their command.
    """
    chosen, joints, drives = roles.motor_effort, roles.joints, drive.joints
    if chosen is None or drive.unit[0] not in VOLTAGES:
        return None
    command = role_stream(roles.command, joints)
    effort = role_stream(chosen, joints)
    window = max(WINDOW, PERIODS * float(np.max(encoder.periods)))
    begin = max(command.times[0] + LATEST, encoder.times[0] + 2.0 * window)
    end = min(command.times[-1], encoder.times[-1] - 2.0 * window)
    inside = np.flatnonzero((effort.times > begin) & (effort.times < end))
    if len(inside) < FEWEST:
        return None
    rows = inside[:: max(len(inside) // SAMPLES, 1)]
    times = effort.times[rows]
    v = windowed_motion(encoder, times, window).v
    h = float(np.min(command.periods))
    shares, slopes = [], []
    for late in h * (np.arange(np.ceil(LATEST / h)) + 0.5):  # a command jumps: each gap between two is tried once
        acting = command.values[np.searchsorted(command.times, times - late, side="right") - 1]
        found = [_fit(effort.values[rows, j], acting[:, j], v[:, j]) for j in range(len(joints))]
        shares.append([share for share, *_ in found])
        slopes.append([by for _, *by in found])
    best = int(np.argmin(np.sum(np.log(np.maximum(shares, 1e-12)), axis=1)))
    by_command, by_speed, offset = np.array(slopes[best]).T
    if max(shares[best]) > FITS or np.any(by_command * by_speed >= 0.0):  # a speed takes away what a command gives
        return None
    turned = np.array([drive.sign for drive in drives]) * by_command
    return GuessedCurrents(
        chosen,
        tuple(guess_each(effort.times, effort.values, ["A"] * len(joints))),
        tuple(np.sign(turned).tolist()),
        tuple(abs(d.start["gain"] / slope) for d, slope in zip(drives, by_command.tolist(), strict=True)),
        tuple(np.abs(by_speed).tolist()),
        tuple((np.sign(turned) * offset).tolist()),
        tuple(d.is_lost("gain") for d in drives),
        max(shares[best]),
    )


def _fit(y: Array, u: Array, v: Array) -> tuple[float, float, float, float]:
    """Share of a channel that command and speed leave, the factors of both, and the constant."""
    size = float(np.std(y))
    if size == 0.0:
        return np.inf, 0.0, 0.0, 0.0
    A = np.column_stack([u, v, np.ones(len(u))])
    found = np.linalg.lstsq(A, y, rcond=None)[0]
    return float(np.std(y - A @ found)) / size, float(found[0]), float(found[1]), float(found[2])
