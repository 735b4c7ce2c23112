# SPDX-License-Identifier: BSD-3-Clause
"""Robots and files as words of a command that a message advises; what a command writes has a new name.

Advice is typed as it stands: a file that is read by a command and written by the same would be lost.
"""

from __future__ import annotations

import shlex
from pathlib import Path

from jointscope.robots.model.robot import Robot

READY_ROOT = Path(__file__).parents[1] / "ready"


def ready_robots() -> dict[str, Path]:
    """The robots that come with the package: name and file."""
    return {path.stem: path for path in sorted(READY_ROOT.glob("*/*.yaml"))}


def robot_argument(robot: Robot) -> str:
    """What a user types to name a robot: the name of a ready one, else the path of its file."""
    stem = robot.path.stem
    return shlex.quote(stem if ready_robots().get(stem) == robot.path else str(robot.path))


def edited_argument(robot: Robot, edit: str) -> str:
    """What a user types to name a file that an edit makes of a robot's: beside it, of a ready robot where he is.

    Args:
        robot: as it is.
        edit: a word for what is done to it, as in "arm_limited.yaml".
    """
    here = ready_robots().get(robot.path.stem) == robot.path
    return edited_path(Path(robot.path.name) if here else robot.path, edit)


def edited_path(path: Path, edit: str) -> str:
    """The same of the path of a robot file, or of a file that has not become a robot."""
    return shlex.quote(str(path.with_name(f"{path.stem}_{edit}.yaml")))
