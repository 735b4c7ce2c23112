# SPDX-License-Identifier: BSD-3-Clause
"""A robot as a bag shows it, before it is replayed: where its other joints stand, how its drive signal was sent."""

from __future__ import annotations

from pathlib import Path

from jointscope.graphs.starts.drive_signal import told_drive_signal
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.read_recording import read_posture, read_recording


def robot_as_recorded(robot: Robot, bag: Path) -> tuple[Robot, list[str]]:
    """The robot with its other joints where the bag has them, its drive signal as it was sent, and what is said."""
    posture, notices = read_posture(bag, robot)
    robot = robot.in_posture(posture)
    if robot.command.held is None and not robot.layout.motors and not robot.free_links:
        try:
            robot, found = told_drive_signal(robot, [read_recording(bag, robot)])
            notices += found
        except RecordingError:  # a replay leaves out what a recording cannot have
            pass
    return robot, [notice.text for notice in notices]
