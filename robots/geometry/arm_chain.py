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

from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS, across, turned
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.error_parameters import LINK_MASS, PAYLOAD, TOOL
from jointscope.robots.urdf.motion_axis import motion_axis

Array = NDArray[np.float64]


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
        turns: axes of mis_y, mis_x, the joint, y' and x' of each joint, base to tip, shape (m, n, 5, 3).
        origins: of the joints, shape (m, n, 3) [m].
        centres: of mass of the links behind them, shape (m, n, 3) [m].
        moments: first moments about each joint of all that it carries, shape (m, n, 3) [kg m].
        masses: of all that each joint carries, shape (n,) [kg].
        payload: at the target [kg].
    """

    target: Array
    by_error: Mapping[str, Array]
    by_joint: Array
    by_bearing: Array
    gravity: Array
    bearing_gravity: Array
    turns: Array
    origins: Array
    centres: Array
    moments: Array
    masses: Array
    payload: float


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
        self._axes = [across(motion_axis(model.joints[j])[3:]) for j in chain]
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

    def at(self, q: Array, values: Mapping[str, float], bearings: Array | None = None) -> ChainPoint:
        """The arm in some poses.

        Args:
            q: angles of the chain's joints, shape (m, n) [rad].
            values: geometric errors and errors of masses by name; those that are not named are zero.
            bearings: tilts of the bearings about x' and y', shape (m, n, 2) [rad].
        """
        m, n = q.shape
        R, o = np.broadcast_to(np.eye(3), (m, 3, 3)), np.zeros((m, 3))
        axes: dict[str, Array] = {}
        turns, origins, centres = np.zeros((n, 5, m, 3)), np.zeros((n, m, 3)), np.zeros((n, m, 3))
        for j, joint in enumerate(self.joints):
            axes |= {f"{joint}.{part}": R[:, :, k] for k, part in enumerate(LENGTHS)}
            o = o + R @ (self._origins[j] + _vector(values, joint))
            R = R @ self._turns[j]
            along, x, y = self._axes[j]
            for k, (part, axis) in enumerate((("mis_y", y), ("mis_x", x))):
                turns[j, k] = R @ axis
                R = R @ turned(axis, np.array(values.get(f"{joint}.{part}", 0.0)))
            turns[j, 2], origins[j] = R @ along, o
            R = R @ turned(along, q[:, j] + values.get(f"{joint}.offset", 0.0))
            turns[j, 3] = R @ y
            if bearings is not None:
                R = R @ turned(y, bearings[:, j, 1])
            turns[j, 4] = R @ x
            if bearings is not None:
                R = R @ turned(x, bearings[:, j, 0])
            centres[j] = o + R @ self._centres[j]
        axes |= {f"{TOOL}.{part}": (R @ self._tool_turn)[:, :, k] for k, part in enumerate(LENGTHS)}
        target = o + R @ (self._lever + self._tool_turn @ _vector(values, TOOL))
        by_turn = cross(turns, (target - origins)[:, None])
        by_error = axes | {
            f"{joint}.{part}": by_turn[j, k] for j, joint in enumerate(self.joints) for k, part in enumerate(ANGLES)
        }
        by_error |= {f"{TOOL}.{part}": np.zeros((m, 3)) for part in ANGLES}  # a target is a point
        masses = self._masses + np.array([values.get(f"{joint}.{LINK_MASS}", 0.0) for joint in self.joints])
        payload = values.get(PAYLOAD, 0.0)
        weights = masses[:, None, None] * centres
        weights[-1] += payload * target
        masses[-1] += payload
        carried = np.cumsum(masses[::-1])[::-1]
        moments = np.cumsum(weights[::-1], axis=0)[::-1] - carried[:, None, None] * origins
        pull = cross(moments, self.gravity_vector)
        loads = np.einsum("jbmk,jmk->mjb", turns, pull)
        return ChainPoint(
            target,
            by_error,
            np.moveaxis(by_turn[:, 2], 0, 2),
            np.moveaxis(by_turn[:, [4, 3]], (0, 1), (2, 3)),
            loads[:, :, 2],
            loads[:, :, [4, 3]],
            np.moveaxis(turns, 2, 0),
            np.moveaxis(origins, 1, 0),
            np.moveaxis(centres, 1, 0),
            np.moveaxis(moments, 1, 0),
            carried,
            payload,
        )


def cross(a: Array, b: Array) -> Array:
    """The cross product along the last axis; much faster than numpy's."""
    (ax, ay, az), (bx, by, bz) = (tuple(each[..., k] for k in range(3)) for each in (a, b))
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def _vector(errors: Mapping[str, float], owner: str) -> Array:
    return np.array([errors.get(f"{owner}.{part}", 0.0) for part in LENGTHS])
