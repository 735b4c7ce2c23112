# SPDX-License-Identifier: BSD-3-Clause
"""All that looks odd in a recording of a robot, and what of it must be mended before anything is computed."""

from __future__ import annotations

from operator import is_

from jointscope.graphs.screening.encoder_jumps import JUMP, jump_notices
from jointscope.graphs.screening.exchanged_joints import EXCHANGED, exchanged_joints
from jointscope.graphs.screening.felt_gravity import FELT_GRAVITY, mistaken_accelerometers
from jointscope.graphs.screening.mistaken_currents import MISTAKEN_CURRENT, mistaken_currents
from jointscope.graphs.screening.mistaken_hold import MISTAKEN_HOLD, mistaken_hold
from jointscope.graphs.screening.mistaken_torque_sensors import MISTAKEN_TORQUE, mistaken_torque_sensors
from jointscope.graphs.screening.mistaken_transmission import MISTAKEN_TRANSMISSION, mistaken_transmission
from jointscope.graphs.screening.saturated_drives import SATURATION, saturated_drives
from jointscope.graphs.screening.unstretched_springs import UNSTRETCHED, unstretched_springs
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.imu_plausibility import MIRRORED
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.recordings.screening import screen

PLAIN_MISTAKES = (
    "unit",
    "axes",
    MIRRORED,
    EXCHANGED,
    SATURATION,
    JUMP,
    FELT_GRAVITY,
    MISTAKEN_TORQUE,
    MISTAKEN_CURRENT,
    MISTAKEN_TRANSMISSION,
    MISTAKEN_HOLD,
    UNSTRETCHED,
)
"""Kinds of notices that say what is wrong in a robot file, or that a recording is one of two robots."""


def screen_all(recording: Recording, robot: Robot) -> list[Notice]:
    """What `screen` says, and all else that looks odd; a recording is screened once for a robot.

    Args:
        recording: what was measured; it keeps what is found.
        robot: what it was measured on.

    Raises:
        RecordingError: as the screening says.
    """
    streams = tuple(recording.streams.values())
    for screened, of_streams, notices in recording.screenings:
        if screened is robot and len(streams) == len(of_streams) and all(map(is_, streams, of_streams)):
            return list(notices)
    notices = _screened(recording, robot)
    recording.screenings.append((robot, streams, notices))
    return list(notices)


def _screened(recording: Recording, robot: Robot) -> list[Notice]:
    odd, transmission = [], mistaken_transmission(recording, robot)
    if transmission is not None:
        odd = [Notice("transmission", MISTAKEN_TRANSMISSION, 0, transmission.sentence(robot))]
        robot = transmission.mended(robot)  # a wrong matrix turns gyros and exceeds limits
    odd += [*screen(recording, robot), *jump_notices(recording, robot)]
    odd += mistaken_accelerometers(recording, robot)
    odd += mistaken_torque_sensors(recording, robot)
    odd += mistaken_currents(recording, robot)
    odd += mistaken_hold(recording, robot)
    odd += unstretched_springs(recording, robot)
    return [*odd, *(exchanged_joints(robot, [recording]) or saturated_drives(robot, [recording]))]
