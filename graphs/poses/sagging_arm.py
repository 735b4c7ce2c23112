# SPDX-License-Identifier: BSD-3-Clause
"""An arm that sags: where its target is for given angles of the motors, and how that depends on every value.

Derivatives may be those of the tool as a body: of its target, and how the tool turns, one below the other.

Gravity is taken where the arm has sagged, in as many looks as that takes (Neubauer et al. 2015, eq. 12
to 14). Derivatives are those of the equilibrium: what moves the arm moves its weight, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.poses.what_gives_way import WhatGivesWay
from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS
from jointscope.robots.errors import RobotError
from jointscope.robots.files.sections.pose_section import no_poses
from jointscope.robots.geometry.arm_chain import ArmChain, ChainPoint
from jointscope.robots.geometry.arm_effects import DRIFT
from jointscope.robots.geometry.error_parameters import TOOL, TRACKER
from jointscope.robots.geometry.gravity_slopes import YIELDING, gravity_slopes
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
LOOKS = 8  # at gravity, the first one at the arm that does not sag
SETTLED = 1e-8  # [rad] that nothing may give way from look to look


@dataclass(frozen=True)
class SaggingPoint:
    """Where the target is, shape (m, 3) [m], with derivatives: k = 3 of its place, k = 6 of its place and its turn.

    Attributes:
        target: in the base frame.
        by_joint: by the turn of each joint of the chain, shape (m, k, n).
        by_value: by each parameter in its unit, by name, shape (m, k).
        sag: how far the target is from where a rigid arm would have it, shape (m, 3) [m].
        turn: orientation of the link of the target, shape (m, 3, 3).
        others: the same of the origins of other links that carry targets, by the number of the joint before them.
    """

    target: Array
    by_joint: Array
    by_value: Mapping[str, Array]
    sag: Array
    turn: Array
    others: Mapping[int, SaggingPoint] = field(default_factory=dict)


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
        links = [target.link for target in robot.poses.targets]
        self.chain = ArmChain(robot.tree, robot.poses.link, robot.poses.at, links)
        self._others = sorted({*self.chain.levels} - {self.chain.level})

    def at(self, q: Array, e: Array, values: Mapping[str, float], turning: bool = False) -> SaggingPoint:
        """The target for angles and transmission errors of the chain's joints, shape (m, n) each [rad].

        Args:
            q: angles of the motors.
            e: what transmissions do unseen.
            values: of all parameters.
            turning: whether derivatives shall be those of the turn of the tool, too.
        """
        chain, parts = self.chain, WhatGivesWay(self.chain.joints, values)
        read = q + e + parts.waves(q)
        rigid = point = chain.at(read, values)
        last = np.zeros((*q.shape, 3))
        for _ in range(LOOKS if parts.some else 0):
            turn, tilt = parts.deflections(point)
            point = chain.at(read + turn, values, tilt)
            now = np.concatenate([turn[:, :, None], tilt], axis=2)
            if np.max(np.abs(now - last), initial=0.0) < SETTLED:
                break
            last = now
        following = _Following.of(chain, point, parts) if parts.some else None

        def seen(there: ChainPoint, turning: bool, turn: Array, sag: Array) -> SaggingPoint:
            by_error, by_yield = _by_error(chain, there, turning), _by_yield(there, turning)
            if following is not None:
                by_error, by_yield = following.of_all(by_error, by_yield)
            by_value = {**by_error, **parts.columns(q, there, by_yield)}
            return SaggingPoint(there.target, by_yield[:, :, : len(chain.joints)], by_value, sag, turn)

        turn = np.stack([point.steps[f"{TOOL}.{part}"] for part in LENGTHS], axis=2)
        found = seen(point, turning, turn, point.target - rigid.target)
        if not (turning and self._others):
            return found
        sags = point.origins - rigid.origins
        others = {k: seen(point.on_link(chain.joints, k), True, point.frames[:, k], sags[:, k]) for k in self._others}
        return replace(found, others=others)


def _by_yield(point: ChainPoint, turning: bool) -> Array:
    """Derivative of the target by turns of the joints, then by tilts of the bearings about x' and y', (m, k, 3 n)."""
    by_yield = np.concatenate([point.by_joint, point.by_bearing[..., 0], point.by_bearing[..., 1]], axis=2)
    if not turning:
        return by_yield
    turns = point.turns.copy()
    turns[:, point.level + 1 :] = 0.0
    axes = np.concatenate([turns[:, :, k] for k in YIELDING], axis=1)
    return np.concatenate([by_yield, np.swapaxes(axes, 1, 2)], axis=1)


def _by_error(chain: ArmChain, point: ChainPoint, turning: bool) -> Mapping[str, Array]:
    """Derivative of the target by each geometric error, shape (m, k); its own orientation is none of the tool."""
    if not turning:
        return point.by_error
    places = [(j, k) for j in range(point.level + 1) for k in range(len(ANGLES))]
    axes = {f"{chain.joints[j]}.{ANGLES[k]}": point.turns[:, j, k] for j, k in places}
    still = np.zeros_like(point.target)
    return {name: np.hstack([column, axes.get(name, still)]) for name, column in point.by_error.items()}


@dataclass(frozen=True)
class _Following:
    """How everything soft follows gravity.

    Deflections x = C tau(x, v) make a target move by T (1 - C H)^-1 C dtau/dv beside what it does itself.

    Attributes:
        soft: C, shape (m, 3 n).
        kept: 1 - C H, transposed, shape (m, 3 n, 3 n).
        by_value: dtau/dv by name, shape (m, 3 n) each.
    """

    soft: Array
    kept: Array
    by_value: Mapping[str, Array]

    @staticmethod
    def of(chain: ArmChain, point: ChainPoint, parts: WhatGivesWay) -> _Following:
        """At the equilibrium of an arm."""
        slopes, soft = gravity_slopes(chain.joints, point, chain.gravity_vector), parts.softness(point)
        kept = np.eye(soft.shape[1]) - soft[:, :, None] * slopes.by_turn
        return _Following(soft, np.swapaxes(kept, 1, 2), slopes.by_value)

    def of_all(self, by_error: Mapping[str, Array], by_yield: Array) -> tuple[Mapping[str, Array], Array]:
        """Derivatives by geometry and masses, and by what gives way, with what gravity answers."""
        by_yield = np.swapaxes(np.linalg.solve(self.kept, np.swapaxes(by_yield, 1, 2)), 1, 2)
        by_load = by_yield * self.soft[:, None]
        found = {name: np.einsum("mka,ma->mk", by_load, slope) for name, slope in self.by_value.items()}
        still = np.zeros(by_yield.shape[:2])
        names = dict.fromkeys([*by_error, *found])
        return {name: by_error.get(name, still) + found.get(name, still) for name in names}, by_yield


def in_tracker(
    point: SaggingPoint, base_from_tracker: Array, values: Mapping[str, float], shares: Array
) -> SaggingPoint:
    """The same in the axes of a tracker, whose own error and drift are added there.

    Args:
        point: in the base frame.
        base_from_tracker: shape (4, 4).
        values: of the parameters.
        shares: of the session that have passed at each pose, shape (m,), from 0 to 1.
    """
    R, o, k = base_from_tracker[:3, :3], base_from_tracker[:3, 3], point.by_joint.shape[1]
    own, each = [f"{TRACKER}.{part}" for part in LENGTHS], np.kron(np.eye(k // 3), R) if k > 3 else R
    by_value = {name: column @ each for name, column in point.by_value.items()}
    shape, axes = (len(point.target), k), np.eye(k)[:3]
    by_value |= {name: np.broadcast_to(axis, shape) for name, axis in zip(own, axes, strict=True)}
    shift = np.array([values.get(name, 0.0) for name in own])
    if DRIFT[0] in values:
        by_value |= {name: shares[:, None] * axis for name, axis in zip(DRIFT, axes, strict=True)}
        shift = shift + shares[:, None] * np.array([values[name] for name in DRIFT])
    seen = (point.target - o) @ R + shift
    others = {n: in_tracker(other, base_from_tracker, values, shares) for n, other in point.others.items()}
    return SaggingPoint(seen, each.T @ point.by_joint, by_value, point.sag @ R, R.T @ point.turn, others)
