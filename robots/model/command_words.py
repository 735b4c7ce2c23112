# SPDX-License-Identifier: BSD-3-Clause
"""Robots and files as words of a command that a message advises; what a command writes has a new name.

Advice is typed as it stands: a file that is read by a command and written by the same would be lost.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path

from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.position_target import PositionTarget

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
    return shlex.quote(str(edited_file(path, edit)))


def edited_file(path: Path, edit: str) -> Path:
    """The file that an edit makes of a robot file, beside it."""
    return path.with_name(f"{path.stem}_{edit}.yaml")


def bag_arguments(paths: Iterable[str | Path], otherwise: str = "") -> str:
    """What a user types to name bags, in their order.

    Args:
        paths: of the bags.
        otherwise: what stands for them where there are none.
    """
    return " ".join(shlex.quote(str(path)) for path in paths) or otherwise


def init_command(robot: Robot, bag: str | Path, edit: str, joints: Sequence[str] = (), unit: str = "") -> str:
    """What a user types to have a robot's file written anew, with all that he said of it when it was written.

    Args:
        robot: as it is.
        bag: the recording.
        edit: a word for what is done to it, see `edited_argument`.
        joints: those to use, if others than now.
        unit: of the command, if another one than now, in words of `jointscope init --unit`.
    """
    begin = f"jointscope init {bag_arguments([robot.tree.urdf, bag])}"
    return " ".join([begin, *_as_said(robot, joints, unit), "-o", edited_argument(robot, edit)])


def _as_said(robot: Robot, joints: Sequence[str], unit: str) -> list[str]:
    """Options of `jointscope init` that say what the file of a robot says."""
    called = dict(zip(robot.joints, robot.motor_encoder.source.names, strict=False))
    used = [f"{joint}={called[joint]}" if called.get(joint, joint) != joint else joint for joint in joints]
    if not joints and (robot.tree.other_joints or any(name != joint for joint, name in called.items())):
        return _as_said(robot, robot.joints, unit)
    options = ["--joints", ",".join(used)] if joints else []
    if robot.name != robot.tree.urdf.stem:
        options += ["--name", robot.name]
    if robot.held_at_mean:
        options += ["--lock", ",".join(robot.held_at_mean)]
    if unit or robot.command.confirmed:
        options += ["--unit", unit or robot.command.unit.replace(" ", "")]
    targets = [sensor for sensor in robot.sensors.values() if isinstance(sensor, PositionTarget)]
    for target in targets:
        options += ["--target", f"{target.source.topic}={target.body}"]
    return [shlex.quote(word) for word in options]
