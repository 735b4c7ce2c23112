# SPDX-License-Identifier: BSD-3-Clause
"""Does a target move as a point of its link? Wrong units, a wrong link, a tracker that stands elsewhere show.

Measured positions are held against those that the encoders imply: as they are, and after the best place of tracker and
target. Springs make the two differ by millimetres; another link by a good part of the motion.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.body_points import body_point
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.tracker_fit import base_from_tracker, tracker_and_shift
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.recordings.joint_motion import JointMotion
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.units import UNITS, si_factor, si_unit

Array = NDArray[np.float64]

MOST_POINTS = 300
FEWEST_POINTS = 20
SAME_SIZE = 5.0  # a ratio of sizes up to this is a target elsewhere on its link, not a unit
NOISE = 10.0  # [sigma] a motion that is smaller says nothing of links, a distance that is smaller nothing of places
ODD = 0.3  # share of the motion that is left of a wrong link; springs leave less
CLEARLY_BETTER = 0.5  # times what is left there may be left of the right one
ALIKE = 4  # decimals [m] in which the fits of two links that one joint moves are the same
ELSEWHERE = 0.3  # of the motion: a tracker that is farther off has been moved
IN_PRIOR = 3.0  # [sigma] how far a calibration goes without being told
ARMS = 0.3  # [m] places of a target on its link to begin with


def check_targets(recording: Recording, robot: Robot, motion: JointMotion) -> list[Notice]:
    """Checks all targets.

    Returns:
        Notices about trackers that stand elsewhere.

    Raises:
        RecordingError: positions in another unit, of a target on another link, or of a tracker that moves.
    """
    notices = []
    for target in robot.targets:
        stream = recording.streams[target.name]
        inside = np.flatnonzero((motion.times >= stream.times[0]) & (motion.times <= stream.times[-1]))
        chosen = inside[:: max(len(inside) // MOST_POINTS, 1)]
        if len(chosen) < FEWEST_POINTS:
            continue
        seen = np.column_stack([np.interp(motion.times[chosen], stream.times, column) for column in stream.values.T])
        notices += _check_target(robot, target, motion.q[chosen], seen)
    return notices


def fitted_tracker(tree: RigidTree, body: str, at: Array, q: Array, seen: Array) -> tuple[Array, Array, float]:
    """Best place of a tracker for a target anywhere on a link.

    Args:
        tree: rigid bodies.
        body: the link.
        at: of the target on it, to begin with, shape (3,) [m].
        q: positions of the joints, shape (m, n) [rad].
        seen: in the tracker, shape (m, 3) [m].

    Returns:
        Base from tracker, shape (4, 4), the target in the axes of its link, shape (3,) [m], and what is left, root mean
        square [m].
    """
    point = body_point(tree, body, np.zeros(3), q)
    starts = (at, *(ARMS * np.eye(3)), *(-ARMS * np.eye(3)))  # alternating from one place may stay in a mirror image
    fits = [tracker_and_shift(point.value, point.R_base_body, seen, start) for start in starts]
    return min(fits, key=lambda fit: fit[2])


def _check_target(robot: Robot, target: PositionTarget, q: Array, seen: Array) -> list[Notice]:
    tree, place = robot.tree, f"sensors.{target.name}"
    values = {name: parameter.value for name, parameter in robot.parameters.items()}
    at, R, origin, _ = target.seen(values)
    expected = (body_point(tree, target.body, at, q).value - origin) @ R
    size, wanted, noise = _spread(seen), _spread(expected), NOISE * target.sigma
    if wanted > noise and not 1.0 / SAME_SIZE < size / wanted < SAME_SIZE:
        _check_unit(target, size / wanted)
    if size < noise:
        return []
    point = body_point(tree, target.body, np.zeros(3), q)
    if tracker_and_shift(point.value, point.R_base_body, seen, at)[2] > max(ODD * size, noise):
        left = fitted_tracker(tree, target.body, at, q, seen)[2]
        if left > max(ODD * size, noise):
            raise RecordingError(_wrong_link(tree, target, q, seen, left, size))
    distance = float(np.sqrt(np.mean(np.sum((expected - seen) ** 2, axis=1))))
    if distance <= max(ELSEWHERE * size, noise):
        return []
    T, after, _ = base_from_tracker(body_point(tree, target.body, at, q).value, seen)
    if _is_expected(robot, target, T, R, origin):
        return []
    text = (
        f"{target.name} is {distance:.3g} m (rms) away from where {robot.path.name} expects it; its tracker may stand "
        f"elsewhere: with sensors.{target.tracker}.tracker_pose: {[[round(x, 5) for x in row] for row in T.tolist()]} "
        f"instead of what {place} says, {after:.3g} m are left"
    )
    return [Notice(target.name, "unit", 0, text)]


def _is_expected(robot: Robot, target: PositionTarget, T: Array, R: Array, origin: Array) -> bool:
    """Whether a calibration may well find the tracker in a pose: its parameters are free, and their priors wide."""
    free = {n: p.prior_sigma for n, p in robot.parameters.items() if n in target.own and not p.fixed}
    turn = pin.log3(R.T @ T[:3, :3])
    away = zip((*target.place, *target.turn), (*(T[:3, 3] - origin), *turn), strict=True)
    return all(abs(x) < IN_PRIOR * free.get(name, 0.0) for name, x in away)


def _spread(points: Array) -> float:
    """Root mean square distance from the mean [m]."""
    return float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))


def _check_unit(target: PositionTarget, ratio: float) -> None:
    """Raises where another unit explains the size of the motion."""
    now = target.source.unit
    text = f"{target.name} moves {ratio:.3g} times as far as a point of {target.body} would"
    for unit in UNITS:
        of_unit = ratio * si_factor(unit) / si_factor(now)
        if si_unit(unit) == "m" and unit != now and 1.0 / SAME_SIZE < of_unit < SAME_SIZE:
            word = {"mm": "millimetres", "m": "metres"}.get(unit, unit)
            raise RecordingError(
                f"{text}; its values look like {word}: set `unit` of sensors.{target.name} in the robot file "
                f"(now {now}) to {unit}"
            )


def _wrong_link(tree: RigidTree, target: PositionTarget, q: Array, seen: Array, left: float, size: float) -> str:
    """What may be wrong where a target does not move as a point of its link."""
    text = (
        f"{target.name} does not move as a point of {target.body}: wherever its tracker and the target are, "
        f"{left:.3g} m of {size:.3g} m are left (rms)"
    )
    others = [body for body in tree.bodies if body != target.body and tree.joints_below(body)]
    fits = {body: fitted_tracker(tree, body, np.zeros(3), q, seen)[2] for body in others}
    best = min(fits, key=lambda body: round(fits[body], ALIKE), default=None)  # the first of those on one joint
    if best is not None and fits[best] < CLEARLY_BETTER * left:
        return (
            f"{text}, of {best} only {fits[best]:.3g} m: set `target` of sensors.{target.name} to {best}, and `at` to "
            "its place there"
        )
    return (
        f"{text}, and no other link fits: the tracker moved while it measured, lost the target, or has another clock; "
        f"check {target.source.topic}, or remove sensors.{target.name} from the robot file"
    )
