# SPDX-License-Identifier: BSD-3-Clause
"""What a user types to name a robot."""

from __future__ import annotations

from jointscope.robots.files.robot_file import ready_robots
from jointscope.robots.model.robot import Robot


def robot_argument(robot: Robot) -> str:
    """The name of a ready robot, else the path of its file."""
    stem = robot.path.stem
    return stem if ready_robots().get(stem) == robot.path else str(robot.path)
