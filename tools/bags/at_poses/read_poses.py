# SPDX-License-Identifier: BSD-3-Clause
"""Poses from a table or a bag."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.sections.pose_section import no_poses
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.at_poses.pose_table import poses_from_table
from jointscope.tools.bags.at_poses.poses_from_bag import poses_from_bag

ROUND = {"deg": (1.0, 0.1, 0.01), "rad": (0.1, 0.01, 0.001)}  # that not all readings of encoders are multiples of
FEWEST = 4  # poses that chance does not make round


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
    return _with_round_angles_told(_read(path, robot))


def _with_round_angles_told(poses: Poses) -> Poses:
    """Says when all angles are round numbers: then they are what was commanded, or digits were cut off."""
    for unit, angles in (("deg", np.rad2deg(poses.q)), ("rad", poses.q)):
        for step in ROUND[unit]:
            if len(poses) >= FEWEST and np.all(np.abs(angles - step * np.round(angles / step)) < 1e-6 * step):
                text = (
                    f"{poses.path}: all angles are multiples of {step:g} {unit}, as commanded ones are; expected what "
                    "the encoders read at rest, to a microradian: the arm may rest elsewhere"
                )
                return replace(poses, notices=(*poses.notices, Notice("poses", "info", len(poses), text)))
    return poses


def _read(path: Path, robot: Robot) -> Poses:
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
