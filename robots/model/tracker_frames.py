# SPDX-License-Identifier: BSD-3-Clause
"""Where the trackers of a robot's targets stand: a link of the base says it, the file, or another target's tracker."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.yaml_section import did_you_mean


def with_trackers(robot: Robot) -> Robot:
    """The robot whose targets know the pose of their tracker.

    Raises:
        RobotError: a target on no link, or on one that no joint moves; a tracker that is unknown, or that moves.
    """
    if not robot.targets:
        return robot
    targets = {target.name: target for target in robot.targets}
    found = {name: _placed(robot, target, targets) for name, target in targets.items()}
    return robot.with_sensors(found)


def _placed(robot: Robot, target: PositionTarget, others: dict[str, PositionTarget]) -> PositionTarget:
    tree, where = robot.tree, f"{robot.path.name}: sensors.{target.name}"
    if robot.free_links:
        raise RobotError(f"{where}: position_target needs link_dynamics: model; remove the sensor, or give masses")
    if target.body not in tree.bodies:
        raise RobotError(f"{where}.target: no link {target.body!r}{did_you_mean(target.body, tree.bodies)}")
    if not tree.joints_below(target.body):
        raise RobotError(f"{where}.target: no joint moves {target.body}; expected the link that carries the target")
    named = target.tracker_link
    if named is None:
        return target
    if named in others and named != target.name:
        other = others[named]
        if other.tracker_link in others:
            raise RobotError(
                f"{where}.tracker: {named} names a target itself; write {other.tracker_link}, or a place of its own"
            )
        pose = other.tracker_pose if other.tracker_link is None else _pose_of_link(robot, other.tracker_link, where)
        return replace(target, tracker_pose=pose, tracker=named)
    if named not in tree.bodies:
        raise RobotError(
            f"{where}.tracker: the frame {named!r} is unknown: no link of {tree.urdf.name} and no other target"
            f"{did_you_mean(named, tree.bodies)}; or write where it stands, `tracker_pose:` with a matrix 4 x 4, base "
            "from tracker"
        )
    return replace(target, tracker_pose=_pose_of_link(robot, named, where))


def _pose_of_link(robot: Robot, link: str, where: str) -> np.ndarray:
    """Base from a link that stands still, shape (4, 4)."""
    frame = robot.tree.model.frames[robot.tree.frame_id(link)]
    if frame.parentJoint:
        raise RobotError(
            f"{where}.tracker: {link} moves with the arm; expected a link of the base: a tracker that rides on the arm "
            "is not supported"
        )
    return np.array(frame.placement.homogeneous)
