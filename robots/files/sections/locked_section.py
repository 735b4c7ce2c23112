# SPDX-License-Identifier: BSD-3-Clause
"""The section `locked_springs` of a robot file: joints whose springs were locked mechanically in some recordings.

    locked_springs: [joint1, joint2]                # in each recording that is given with --locked-springs
    locked_springs: {bench: [joint1], late: [joint1, joint2]}   # in bench.mcap, bench.bag or the folder bench; ...

Without it, a recording that is given with --locked-springs has all springs locked. A recording that the section names
is of no use as one of motion or rests: the robot was another one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jointscope.robots.errors import RobotError
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.yaml_section import Section, did_you_mean

KEY = "locked_springs"
BAGS = (".bag", ".db3", ".mcap")


def check_locked_springs(top: Section, robot: Robot) -> None:
    """The section names joints of the robot that have springs; it is the last one of a file that is asked for.

    Args:
        top: the whole file.
        robot: whose file it is.

    Raises:
        RobotError: neither a list nor lists by recording, no such joint, or a joint without a spring; unknown keys.
    """
    content = top.raw(KEY)
    top.finish()
    if content is None:
        return
    place = f"{robot.path.name}: {KEY}"
    lists = content if isinstance(content, dict) else {"": content}
    for recording, joints in lists.items():
        where = f"{place}.{recording}" if recording else place
        if not isinstance(joints, list) or not joints or not all(isinstance(joint, str) for joint in joints):
            raise RobotError(
                f"{where}: expected a list of joints, or one for each recording ({{bench: [{robot.joints[0]}]}}), "
                f"got {joints!r}"
            )
        for k, joint in enumerate(joints):
            if joint in joints[:k]:
                raise RobotError(f"{where}: {joint} stands there twice; write it once")
            if joint not in robot.joints:
                raise RobotError(f"{where}: no joint {joint!r}{did_you_mean(joint, robot.joints)}")
            if joint not in robot.layout.motors:
                raise RobotError(f"{where}: {joint} is declared rigid, so it has no spring to lock; leave it out")


def locked_in(robot: Robot, path: str | Path) -> tuple[str, ...]:
    """Joints whose springs are locked in a recording that is said to have locked ones.

    Raises:
        RobotError: no joint of the robot has a spring, or its file names other recordings only.
    """
    content = _content(robot)
    if content is None:
        found = tuple(joint for joint in robot.joints if joint in robot.layout.motors)
        if not found:
            raise RobotError(f"{robot.path.name}: all joints are declared rigid, so there is no spring to lock")
        return found
    if not isinstance(content, dict):
        return _in_order(robot, content)
    name = recording_name(path)
    if name not in content:
        raise RobotError(
            f"{robot.path.name}: {KEY} names {', '.join(map(str, content))}, but not {name}; add `{name}: [JOINT, ...]`"
        )
    return _in_order(robot, content[name])


def names_recording(robot: Robot, path: str | Path) -> bool:
    """Whether the file of a robot says that the springs of a recording are locked."""
    content = _content(robot)
    return isinstance(content, dict) and recording_name(path) in content


def no_motion_text(robot: Robot, path: str | Path) -> str:
    """What is wrong with a recording of locked springs that is given as another kind."""
    return (
        f"{path}: {KEY} of {robot.path.name} says that springs were locked there, so it is no recording of the robot's "
        f"motion; give it as `jointscope calibrate {robot_argument(robot)} ... --locked-springs {path}`"
    )


def recording_name(path: str | Path) -> str:
    """Name of a bag without its ending."""
    path = Path(path)
    return path.stem if path.suffix in BAGS else path.name


def _content(robot: Robot) -> Any:
    content = robot.document.get(KEY) if robot.document is not None else None
    # a name of digits alone is a number in YAML
    return {str(name): joints for name, joints in content.items()} if isinstance(content, dict) else content


def _in_order(robot: Robot, joints: Any) -> tuple[str, ...]:
    return tuple(joint for joint in robot.joints if joint in list(joints))
