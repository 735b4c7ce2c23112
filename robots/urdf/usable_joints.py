# SPDX-License-Identifier: BSD-3-Clause
"""Which joints of a URDF can be those of a robot, and which can be locked: complaints about all others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from jointscope.robots.errors import RobotError
from jointscope.robots.urdf.urdf_bodies import UrdfBodies

TURN = 2.0 * np.pi  # [rad]


def moving_joints(urdf: Path) -> tuple[str, ...]:
    """Names of the joints that can be a robot's: revolute, continuous, prismatic; no mimic ones. Base to tip.

    Raises:
        RobotError: no such file, no URDF, or none of its joints is of that kind.
    """
    names = UrdfBodies.read(urdf).free
    if not names:
        raise RobotError(
            f"{urdf.name} has no moving joint that can be used: expected revolute, continuous or prismatic ones"
        )
    return names


def check_moving(bodies: UrdfBodies, joints: Sequence[str]) -> None:
    """Complains about joints that cannot be those of a robot.

    Raises:
        RobotError: a joint is not there, follows another one, or has several axes or none.
    """
    file, free = bodies.path.name, bodies.free
    for joint in joints:
        if joint in bodies.followers:
            follower = bodies.followers[joint]
            raise RobotError(
                f"{file}: {joint} is a mimic joint: it follows {follower.leader} ({follower.factor:g} times its "
                f"position) and is modelled with it; leave {joint} out of the joints"
                + ("" if follower.leader in joints or follower.leader not in free else f", name {follower.leader}")
            )
        if joint in bodies.names and joint not in free:
            raise RobotError(
                f"{file}: {joint} is a floating or planar joint, which has several axes; joints can be revolute, "
                "continuous or prismatic. Leave it out: it is then locked where the URDF places it"
            )
        if joint not in free:
            raise RobotError(f"{file} has no moving joint {joint!r}; it has {', '.join(free)}")
        if not bodies.has_axis(joint):
            raise RobotError(f'{file}: joint {joint} has no axis; expected a direction such as <axis xyz="0 0 1"/>')


def check_locked(bodies: UrdfBodies, joints: Sequence[str], locked: Mapping[str, float]) -> None:
    """Complains about joints that cannot be locked, or not there.

    Raises:
        RobotError: one is not in the URDF, moves, follows another one, or its position is not finite.
    """
    file = bodies.path.name
    lockable = [name for name in bodies.free if name not in joints]
    for joint, position in locked.items():
        if joint in joints:
            raise RobotError(f"locked: {joint} is one of the robot's joints, which move; remove it from one of the two")
        if joint in bodies.followers:
            leader = bodies.followers[joint].leader
            if leader in joints:
                advice = f"which is one of the robot's joints; remove {joint}"
            else:
                advice = f"lock {leader} instead" if leader in lockable else f"which does not move; remove {joint}"
            raise RobotError(f"locked: {joint} is a mimic joint of {file} and follows {leader}: {advice}")
        if joint not in lockable:
            some = ", ".join(lockable) or "no other joint"
            raise RobotError(f"locked: {file} has no joint {joint!r} that can be locked; it has {some}")
        if not np.isfinite(position):
            raise RobotError(f"locked: position {position} of {joint}; expected a finite number [rad] or [m]")


def check_within_limits(bodies: UrdfBodies, locked: Mapping[str, float]) -> None:
    """Complains about positions that a user wrote down in degrees.

    Zeros of encoders and limits of URDFs are not that exact: a joint may stand up to a turn outside.

    Raises:
        RobotError: a joint that turns is locked more than a turn outside of its limits.
    """
    for joint, position in locked.items():
        low, high = bodies.limits(joint)
        if not bodies.is_slide(joint) and low < high and not low - TURN < position < high + TURN:
            raise RobotError(
                f"locked: {joint} at {position:g} rad is far outside of the limits {low:g} to {high:g} rad of "
                f"{bodies.path.name}; expected radians: {np.radians(position):.4g} if it is {position:g} degrees"
            )
