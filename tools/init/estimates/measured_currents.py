# SPDX-License-Identifier: BSD-3-Clause
"""Whether efforts that motors report are their currents: so their commands and speeds explain them.

Of a motor on a voltage the current is a u - b v + c. Where that holds for all joints the efforts are a sensor, a second
witness of the torque. In which unit they are nothing says: amperes are assumed, and the torque of one is a parameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.problem.timeline import Timeline
from jointscope.graphs.screening.current_delay import FITS, least_left, tried_delays
from jointscope.graphs.screening.drive_currents import DriveCurrents
from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.estimates.drive_values import Drives
from jointscope.tools.init.estimates.measured_robot import role_stream
from jointscope.tools.init.streams.named_signal import Chosen
from jointscope.tools.init.streams.roles import Roles
from jointscope.tools.init.streams.sensor_noise import NoiseGuess, guess_each

Array = NDArray[np.float64]

VOLTAGES = ("V", "duty")  # units of commands whose motors lose current by their speed


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
    command, effort = role_stream(roles.command, joints), role_stream(chosen, joints)
    ticks = np.append(command.times, command.times[-1] + np.min(command.periods))
    seen = DriveCurrents.beside(effort, encoder, Timeline(ticks, command.values), by_volts=True)
    if seen is None:
        return None
    tried = tried_delays(seen.h)
    fits = [[seen.fit(j, j, late, late) for j in range(len(joints))] for late in tried]
    shares = np.array([[fit.share for fit in each] for each in fits])
    best = least_left(shares)
    by_command, by_speed, offset = np.array([(fit.by_command, fit.by_speed, fit.at_rest) for fit in fits[best]]).T
    share = float(shares[best].max())
    if share > FITS or np.any(by_command * by_speed >= 0.0):  # a speed takes away what a command gives
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
        share,
    )
