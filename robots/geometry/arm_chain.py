# SPDX-License-Identifier: BSD-3-Clause
"""The chain from the base of an arm to a target on it, with errors of every link and joint, many poses at once.

    o_j = o_i + R_i (p_j + l_j),    R_j = R_i P_j Ry'(mis_y) Rx'(mis_x) Ra(offset + q_j) Ry'(beta_y) Rx'(beta_x)

a is the axis of the joint, x' the x axis of its frame (y for joints about x), y' = a x x'. Bearings beta turn with the
arm. The torque of gravity about any of these axes is u' ((sum m c - o sum m) x g); what is moved by it sags by that
torque over its stiffness (Neubauer et al. 2015, eq. 1, 12 to 14).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.error_parameters import ANGLES, LENGTHS, TOOL
from jointscope.robots.model.structured_tree import joint_motion_axis

Array = NDArray[np.float64]
ALONG_X = 0.9  # cosine from which an axis is along x, so that y takes its place as the direction across


@dataclass(frozen=True)
class ChainPoint:
    """An arm in m poses.

    Attributes:
        target: where the target is in the base frame, shape (m, 3) [m].
        by_error: derivative of the target by each geometric error, by name, shape (m, 3) each.
        by_joint: the same by the turn of each joint, shape (m, 3, n).
        by_bearing: the same by the tilt of each joint's bearing about x' and y', shape (m, 3, n, 2).
        gravity: torque of gravity about the axis of each joint, shape (m, n) [N m].
        bearing_gravity: the same about x' and y', shape (m, n, 2) [N m].
    """

    target: Array
    by_error: Mapping[str, Array]
    by_joint: Array
    by_bearing: Array
    gravity: Array
    bearing_gravity: Array


class ArmChain:
    """The joints that carry a target.

    Args:
        tree: the arm.
        link: link of the URDF whose frame is at the target.
        at: the target in the axes of that link, shape (3,) [m].

    Attributes:
        joints: names of the joints of the chain, base to tip.
        places: index of each in the order of the tree's joints.

    Raises:
        RobotError: no such link, or a joint of the chain does not turn.
    """

    def __init__(self, tree: RigidTree, link: str, at: Array):
        model = tree.model
        frame = model.frames[tree.frame_id(link)]
        chain = [j for j in model.supports[frame.parentJoint].tolist() if j]
        self.joints = tuple(model.names[j] for j in chain)
        slides = [joint for joint in self.joints if tree.is_slide(joint)]
        strange = [joint for joint in self.joints if joint not in tree.joints]
        if slides or strange or not chain:
            raise RobotError(
                f"{link} is carried by {', '.join(self.joints) or 'no joint'}; expected joints of the robot that turn"
                + (f", {(slides or strange)[0]} is none" if chain else "")
            )
        self.places = np.array([tree.joints.index(joint) for joint in self.joints])
        self.gravity_vector = tree.gravity
        self._origins = [np.array(model.jointPlacements[j].translation) for j in chain]
        self._turns = [np.array(model.jointPlacements[j].rotation) for j in chain]
        self._axes = [across(joint_motion_axis(model, j)[3:]) for j in chain]
        self._lever = np.array(frame.placement.act(at))
        self._tool_turn = np.array(frame.placement.rotation)
        self._masses = np.array([model.inertias[j].mass for j in chain])
        self._centres = [np.array(model.inertias[j].lever) for j in chain]
        branches = [j for j in range(1, model.njoints) if j not in chain]
        if branches and any(model.inertias[j].mass > 0.0 for j in branches):
            raise RobotError(
                f"{', '.join(model.names[j] for j in branches)} does not carry {link} and has a mass; hold it with "
                "`locked` in the robot file"
            )

    def at(self, q: Array, errors: Mapping[str, float], bearings: Array | None = None) -> ChainPoint:
        """The arm in some poses.

        Args:
            q: angles of the chain's joints, shape (m, n) [rad].
            errors: geometric errors by name; those that are not named are zero.
            bearings: tilts of the bearings about x' and y', shape (m, n, 2) [rad].
        """
        m, n = q.shape
        R, o = np.broadcast_to(np.eye(3), (m, 3, 3)), np.zeros((m, 3))
        axes: dict[str, Array] = {}
        centres, points = {}, {}
        moments, masses = np.zeros((n, m, 3)), self._masses
        joint_axes, bearing_axes, origins = np.zeros((n, m, 3)), np.zeros((n, 2, m, 3)), np.zeros((n, m, 3))
        for j, joint in enumerate(self.joints):
            axes |= {f"{joint}.{part}": R[:, :, k] for k, part in enumerate(LENGTHS)}
            o = o + R @ (self._origins[j] + _vector(errors, joint))
            R = R @ self._turns[j]
            along, x, y = self._axes[j]
            for part, axis in (("mis_y", y), ("mis_x", x)):
                centres[f"{joint}.{part}"], points[f"{joint}.{part}"] = o, R @ axis
                R = R @ turned(axis, np.array(errors.get(f"{joint}.{part}", 0.0)))
            joint_axes[j], origins[j] = R @ along, o
            centres[f"{joint}.offset"], points[f"{joint}.offset"] = o, joint_axes[j]
            R = R @ turned(along, q[:, j] + errors.get(f"{joint}.offset", 0.0))
            bearing_axes[j, 1] = R @ y
            if bearings is not None:
                R = R @ turned(y, bearings[:, j, 1])
            bearing_axes[j, 0] = R @ x
            if bearings is not None:
                R = R @ turned(x, bearings[:, j, 0])
            moments[j] = masses[j] * (o + R @ self._centres[j])
        axes |= {f"{TOOL}.{part}": (R @ self._tool_turn)[:, :, k] for k, part in enumerate(LENGTHS)}
        target = o + R @ (self._lever + self._tool_turn @ _vector(errors, TOOL))
        by_error = axes | {name: np.cross(points[name], target - centres[name]) for name in points}
        by_error |= {f"{TOOL}.{part}": np.zeros((m, 3)) for part in ANGLES}  # a target is a point
        by_joint = np.cross(joint_axes, target - origins)
        by_bearing = np.cross(bearing_axes, (target - origins)[:, None])
        carried = np.cumsum(moments[::-1], axis=0)[::-1] - np.cumsum(masses[::-1])[::-1, None, None] * origins
        pull = np.cross(carried, self.gravity_vector)
        return ChainPoint(
            target,
            by_error,
            np.moveaxis(by_joint, 0, 2),
            np.moveaxis(by_bearing, (0, 1), (2, 3)),
            np.einsum("jmk,jmk->mj", joint_axes, pull),
            np.einsum("jbmk,jmk->mjb", bearing_axes, pull),
        )


def _vector(errors: Mapping[str, float], owner: str) -> Array:
    return np.array([errors.get(f"{owner}.{part}", 0.0) for part in LENGTHS])


def across(along: Array) -> tuple[Array, Array, Array]:
    """The axis of a joint, and the two directions across it, x' and y'."""
    x = np.eye(3)[1 if abs(along[0]) > ALONG_X else 0]
    x = x - along * (along @ x)
    x = x / np.linalg.norm(x)
    return along, x, np.cross(along, x)


def turned(axis: Array, angle: Array) -> Array:
    """Rotations about one axis, shape (m, 3, 3) or (3, 3)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = angle[..., None, None]
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K))
