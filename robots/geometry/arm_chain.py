# SPDX-License-Identifier: BSD-3-Clause
"""The chain from the base of an arm to a target on it, with errors of every link and joint, many poses at once.

    o_j = o_i + R_i (p_j + l_j),    R_j = R_i P_j Ry'(mis_y) Rx'(mis_x) Ra(offset + q_j) Ry'(beta_y) Rx'(beta_x)

a is the axis of the joint, x' the x axis of its frame (y for joints about x), y' = a x x'. Bearings beta turn with the
arm. The torque of gravity about any of these axes is u' ((sum m c - o sum m) x g); what is moved by it sags by that
torque over its stiffness (Neubauer et al. 2015, eq. 1, 12 to 14).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS, across, turned
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.error_parameters import LINK_MASS, LINK_MOMENTS, PAYLOAD, TOOL
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
        frames: orientations of the links behind the joints, shape (m, n, 3, 3).
        steps: derivative of all that a joint carries by the lengths at it, by name, shape (m, 3) each.
        level: number of the joint behind which the target is.
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
    frames: Array
    steps: Mapping[str, Array]
    level: int

    def on_link(self, joints: Sequence[str], level: int) -> ChainPoint:
        """The same arm with the origin of another link as its target.

        Args:
            joints: names of those of the chain.
            level: number of the joint behind which the link is.
        """
        still = np.zeros_like(self.target)
        steps = {name: still if name.startswith(f"{TOOL}.") else step for name, step in self.steps.items()}
        seen = _slopes(joints, (self.turns, self.origins, steps), level, self.origins[:, level])
        return replace(self, level=level, **seen)


class ArmChain:
    """The joints that carry a target.

    The chain goes on behind the target as long as what follows has a mass, or carries another target: it weighs.

    Args:
        tree: the arm.
        link: link of the URDF whose frame is at the target.
        at: the target in the axes of that link, shape (3,) [m].
        others: links of the URDF that carry further targets.

    Attributes:
        joints: names of the joints of the chain, base to tip.
        places: index of each in the order of the tree's joints.
        level: number of the joint behind which the target is.
        levels: the same of each link in `others`.

    Raises:
        RobotError: no such link, a joint of the chain does not turn, or a link is not on it.
    """

    def __init__(self, tree: RigidTree, link: str, at: Array, others: Sequence[str] = ()):
        model = tree.model
        frame = model.frames[tree.frame_id(link)]
        carriers = [int(model.frames[tree.frame_id(other)].parentJoint) for other in others]
        turning = {j for j in range(1, model.njoints) if model.names[j] in tree.joints}
        turning -= {j for j in turning if tree.is_slide(model.names[j])}
        chain = _chain(model, int(frame.parentJoint), carriers, turning)
        self.joints = tuple(model.names[j] for j in chain)
        slides = [joint for joint in self.joints if tree.is_slide(joint)]
        strange = [joint for joint in self.joints if joint not in tree.joints]
        if slides or strange or not chain:
            raise RobotError(
                f"{link} is carried by {', '.join(self.joints) or 'no joint'}; expected joints of the robot that turn"
                + (f", {(slides or strange)[0]} is none" if chain else "")
            )
        for other, carrier in zip(others, carriers, strict=True):
            if carrier not in chain:
                raise RobotError(_not_on_chain(other, model.names[carrier] if carrier else "", link, self.joints))
        self.level = chain.index(int(frame.parentJoint))
        self.levels = tuple(chain.index(carrier) for carrier in carriers)
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
        steps: dict[str, Array] = {}
        turns, origins, centres = np.zeros((n, 5, m, 3)), np.zeros((n, m, 3)), np.zeros((n, m, 3))
        frames = np.zeros((n, m, 3, 3))
        for j, joint in enumerate(self.joints):
            steps |= {f"{joint}.{part}": R[:, :, k] for k, part in enumerate(LENGTHS)}
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
            centres[j], frames[j] = o + R @ self._centres[j], R
        R = frames[self.level]
        steps |= {f"{TOOL}.{part}": (R @ self._tool_turn)[:, :, k] for k, part in enumerate(LENGTHS)}
        target = origins[self.level] + R @ (self._lever + self._tool_turn @ _vector(values, TOOL))
        turns, origins = np.moveaxis(turns, 2, 0), np.moveaxis(origins, 1, 0)
        seen = _slopes(self.joints, (turns, origins, steps), self.level, target)
        masses = self._masses + np.array([values.get(f"{joint}.{LINK_MASS}", 0.0) for joint in self.joints])
        payload = values.get(PAYLOAD, 0.0)
        weights = masses[:, None, None] * centres
        for j, joint in enumerate(self.joints):
            weights[j] += frames[j] @ np.array([values.get(f"{joint}.{part}", 0.0) for part in LINK_MOMENTS])
        weights[self.level] += payload * target
        masses[self.level] += payload
        carried = np.cumsum(masses[::-1])[::-1]
        moments = np.moveaxis(np.cumsum(weights[::-1], axis=0)[::-1], 1, 0) - carried[:, None] * origins
        loads = np.einsum("mjbk,mjk->mjb", turns, cross(moments, self.gravity_vector))
        return ChainPoint(
            **seen,
            gravity=loads[:, :, 2],
            bearing_gravity=loads[:, :, [4, 3]],
            turns=turns,
            origins=origins,
            centres=np.moveaxis(centres, 1, 0),
            moments=moments,
            masses=carried,
            payload=payload,
            frames=np.moveaxis(frames, 1, 0),
            steps=steps,
            level=self.level,
        )


def _slopes(
    joints: Sequence[str], arm: tuple[Array, Array, Mapping[str, Array]], level: int, target: Array
) -> dict[str, Any]:
    """A target and its derivatives by what carries it; what stands behind its joint does not move it.

    Args:
        joints: names of those of the chain.
        arm: turns, origins and steps, as of `ChainPoint`.
        level: number of the joint behind which the target is.
        target: where it is, shape (m, 3) [m].
    """
    turns, origins, steps = arm
    still = np.zeros_like(target)
    by_turn = cross(turns, (target[:, None] - origins)[:, :, None])
    by_turn[:, level + 1 :] = 0.0
    carrying = {*joints[: level + 1], TOOL}
    by_error = {name: step if name.partition(".")[0] in carrying else still for name, step in steps.items()}
    by_error |= {f"{joint}.{part}": by_turn[:, j, k] for j, joint in enumerate(joints) for k, part in enumerate(ANGLES)}
    by_error |= {f"{TOOL}.{part}": still for part in ANGLES}  # a target is a point
    by_yield = np.moveaxis(by_turn, 3, 1)
    return {
        "target": target,
        "by_error": by_error,
        "by_joint": by_yield[:, :, :, 2],
        "by_bearing": by_yield[:, :, :, [4, 3]],
    }


def _chain(model: Any, carrier: int, others: Sequence[int], turning: Collection[int]) -> list[int]:
    """Numbers of the joints from the base to a target, to those of `others` that are further out, and to what weighs.

    Args:
        model: the tree.
        carrier: joint that carries the target.
        others: joints that carry further ones.
        turning: joints that may stand behind the target's.
    """

    def ahead(j: int) -> list[int]:
        return [int(k) for k in range(1, model.njoints) if model.parents[k] == j]

    def matters(j: int) -> bool:
        behind = [int(k) for k in model.subtrees[j].tolist()]
        return any(model.inertias[k].mass > 0.0 or k in others for k in behind)

    chain = [int(j) for j in model.supports[carrier].tolist() if j]
    while chain and len(following := [j for j in ahead(chain[-1]) if matters(j)]) == 1 and following[0] in turning:
        chain += following
    return chain


def _not_on_chain(other: str, carrier: str, link: str, joints: Sequence[str]) -> str:
    """What is said of a link with a target that stands elsewhere."""
    if not carrier:
        return f"{other} does not move with the arm; expected a link that {' or '.join(joints[:2])} moves"
    return (
        f"{other} is carried by {carrier}, which is not on the way from the base through {link}; expected a link "
        f"behind one of {', '.join(joints)}"
    )


def cross(a: Array, b: Array) -> Array:
    """The cross product along the last axis; much faster than numpy's."""
    (ax, ay, az), (bx, by, bz) = (tuple(each[..., k] for k in range(3)) for each in (a, b))
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def _vector(errors: Mapping[str, float], owner: str) -> Array:
    return np.array([errors.get(f"{owner}.{part}", 0.0) for part in LENGTHS])
