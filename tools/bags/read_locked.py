# SPDX-License-Identifier: BSD-3-Clause
"""Recordings with locked springs from bags, and the transmission that they show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from jointscope.graphs.locked_springs.coupling import Coupling, find_coupling
from jointscope.graphs.locked_springs.locked_readings import LockedReadings, no_link_encoders
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.sections.locked_section import locked_in
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import must_count_once
from jointscope.robots.rests.angle_units import check_angle_units
from jointscope.tools.bags.read_recording import read_recording


def read_locked(path: str | Path, robot: Robot) -> LockedReadings:
    """What motors and links read in a bag while springs are locked.

    Args:
        path: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
        robot: says which topics, and in `locked_springs` which springs; all without it.

    Raises:
        RobotError: no spring is there that could be locked, or the file names other recordings.
        RecordingError: the bag cannot be read, has no encoders on the links, angles in another unit, or hardly any
            motion.
    """
    robot.need_motion()
    joints = locked_in(robot, path)
    if robot.link_encoder is None:
        raise RecordingError(no_link_encoders(path, robot))
    encoders = {s.name: s for s in (robot.motor_encoder, robot.link_encoder) if s is not None}
    recording = read_recording(path, replace(robot, sensors=encoders), locked_springs=True)
    if all(len(stream) for stream in recording.streams.values()):
        check_angle_units(recording, robot, coupled=robot.transmission is not None)
    return LockedReadings.of(recording, robot, joints)


def read_coupling(paths: Sequence[str | Path], robot: Robot) -> Coupling:
    """The transmission of a robot from its recordings with locked springs.

    Raises:
        JointscopeError: as of `read_locked`, or a spring deflects.
    """
    found = [read_locked(path, robot) for path in paths]
    must_count_once(((readings.path, readings.sha256) for readings in found), "--locked-springs")
    return find_coupling(robot, found)
