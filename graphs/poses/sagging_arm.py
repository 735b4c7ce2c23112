# SPDX-License-Identifier: BSD-3-Clause
"""An arm that sags: where its target is for given angles of the motors, and how that depends on every value.

    q_j = q_motor_j + c cos(q_motor_j) + s sin(q_motor_j) + e_j + g_j / k_j - sign(g_j) w_j,    beta = g_beta / k_beta

c and s are the eccentricity of an encoder, e what the transmission does and no encoder sees, g the torque of gravity, w
the backlash as Neubauer et al. (2015, eq. 18) have it. Gravity is taken where the arm has sagged; a second look
changes the target by nanometres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError
from jointscope.robots.files.pose_section import no_poses
from jointscope.robots.geometry.arm_chain import ArmChain
from jointscope.robots.geometry.error_parameters import BACKLASH, BEARING, LENGTHS, STIFFNESS, TRACKER, WAVES
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
LOOKS = 2  # at gravity, the first one at the arm that does not sag


@dataclass(frozen=True)
class SaggingPoint:
    """Where the target is, shape (m, 3) [m], with derivatives.

    Attributes:
        target: in the base frame.
        by_joint: by the turn of each joint of the chain, shape (m, 3, n).
        by_value: by each parameter in its unit, by name, shape (m, 3).
        sag: how far the target is from where a rigid arm would have it, shape (m, 3) [m].
    """

    target: Array
    by_joint: Array
    by_value: Mapping[str, Array]
    sag: Array


class SaggingArm:
    """The target of a robot with a section `poses`.

    Args:
        robot: the robot.

    Attributes:
        chain: the joints that carry the target.

    Raises:
        RobotError: it has no such section, or its target hangs on no chain of turning joints.
    """

    def __init__(self, robot: Robot):
        if robot.poses is None:
            raise RobotError(no_poses(robot))
        self.chain = ArmChain(robot.tree, robot.poses.link, robot.poses.at)

    def at(self, q: Array, e: Array, values: Mapping[str, float]) -> SaggingPoint:
        """The target for angles and transmission errors of the chain's joints, shape (m, n) each [rad]."""
        chain, joints = self.chain, self.chain.joints
        drives = {j: f"{joint}.{STIFFNESS}" for j, joint in enumerate(joints) if f"{joint}.{STIFFNESS}" in values}
        gaps = {j: f"{joint}.{BACKLASH}" for j, joint in enumerate(joints) if f"{joint}.{BACKLASH}" in values}
        soft = {
            (j, axis): f"{joint}.{part}"
            for j, joint in enumerate(joints)
            for axis, part in enumerate(BEARING)
            if f"{joint}.{part}" in values
        }
        waves = {
            f"{joint}.{part}": (j, wave(q[:, j]))
            for j, joint in enumerate(joints)
            for part, wave in zip(WAVES, (np.cos, np.sin), strict=True)
            if f"{joint}.{part}" in values
        }
        e = e.copy()
        for name, (j, wave) in waves.items():
            e[:, j] += values[name] * wave
        rigid = point = chain.at(q + e, values)
        turn, tilt = np.zeros_like(q), np.zeros((*q.shape, 2))
        for _ in range(LOOKS if drives or gaps or soft else 0):
            turn, tilt = np.zeros_like(q), np.zeros((*q.shape, 2))
            for j, name in drives.items():
                turn[:, j] = point.gravity[:, j] / values[name]
            for j, name in gaps.items():
                turn[:, j] -= np.sign(point.gravity[:, j]) * values[name]
            for (j, axis), name in soft.items():
                tilt[:, j, axis] = point.bearing_gravity[:, j, axis] / values[name]
            point = chain.at(q + e + turn, values, tilt)
        by_value = dict(point.by_error)
        for j, name in drives.items():
            by_value[name] = -point.by_joint[:, :, j] * (point.gravity[:, j] / values[name] ** 2)[:, None]
        for name, (j, wave) in waves.items():
            by_value[name] = point.by_joint[:, :, j] * wave[:, None]
        for j, name in gaps.items():
            by_value[name] = -point.by_joint[:, :, j] * np.sign(point.gravity[:, j])[:, None]
        for (j, axis), name in soft.items():
            bent = point.bearing_gravity[:, j, axis] / values[name] ** 2
            by_value[name] = -point.by_bearing[:, :, j, axis] * bent[:, None]
        return SaggingPoint(point.target, point.by_joint, by_value, point.target - rigid.target)


def in_tracker(point: SaggingPoint, base_from_tracker: Array, values: Mapping[str, float]) -> SaggingPoint:
    """The same in the axes of a tracker, whose own error is added there."""
    R, o = base_from_tracker[:3, :3], base_from_tracker[:3, 3]
    own = [f"{TRACKER}.{part}" for part in LENGTHS]
    by_value = {name: column @ R for name, column in point.by_value.items()}
    by_value |= {name: np.broadcast_to(axis, point.target.shape) for name, axis in zip(own, np.eye(3), strict=True)}
    shift = np.array([values.get(name, 0.0) for name in own])
    return SaggingPoint((point.target - o) @ R + shift, R.T @ point.by_joint, by_value, point.sag @ R)
