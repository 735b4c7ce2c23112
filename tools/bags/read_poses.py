# SPDX-License-Identifier: BSD-3-Clause
"""Poses from a table or a bag."""

from __future__ import annotations

from pathlib import Path

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.pose_section import no_poses
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.tools.bags.pose_table import poses_from_table
from jointscope.tools.bags.poses_from_bag import poses_from_bag


def read_poses(path: Path, robot: Robot) -> Poses:
    """Reads a table (.csv), a bag, or a folder with one of them.

    Raises:
        RobotError: the robot file does not say what is measured of a pose.
        RecordingError: it cannot be read, or holds no poses.
    """
    if robot.poses is None:
        raise RobotError(no_poses(robot))
    if not path.exists():
        raise RecordingError(f"there is no {path}; expected a table of poses (.csv) or a bag")
    if path.suffix.lower() in (".csv", ".txt"):
        return poses_from_table(path, robot)
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        inside = sorted(child for child in path.iterdir() if (child / "metadata.yaml").is_file())
        tables = sorted(path.glob("*.csv"))
        if len(inside) == 1:
            return poses_from_bag(inside[0], robot)
        if not inside and len(tables) == 1:
            return poses_from_table(tables[0], robot)
        raise RecordingError(f"{path} holds {len(inside)} bags and {len(tables)} tables; name the one that is meant")
    return poses_from_bag(path, robot)
