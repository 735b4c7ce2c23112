# SPDX-License-Identifier: BSD-3-Clause
"""Does a target move as a point of its link? Units, links, trackers that are left-handed, late or moved show.

Measured positions are held against those that the encoders imply: as they are, and after the best place of tracker and
target. Springs make the two differ by millimetres; another link by a good part of the motion.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.body_points import body_point
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.tracker_fit import base_from_tracker, tracker_and_shift
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import RIGHT_FROM_LEFT
from jointscope.robots.recordings.joint_motion import JointMotion
from jointscope.robots.recordings.recording import Notice, Recording, Stream
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
LATEST, STEP = 0.2, 0.004  # [s] delays that are looked for
FEW_ROUNDS = 30  # of a fit where only its delay is asked for
MIRRORED = 0.5  # times what is left of right-handed positions may be left of mirrored ones
LATE_TRACKER = "timing"  # kind of the notice about a tracker whose stamps are late or early
MOVED_TRACKER = "moved"  # of that about one that was moved while it measured
JUMP, USUAL_SHARE = 5.0, 0.98  # times what this share of the samples stay below: springs do not bend in a sample
BESIDE = 5  # samples on each side of a jump that show whether it lasts
DELAY = "encoder_delay"  # the effect of a late tracker
BELOW_ZERO = ", below zero, as where the clocks of two computers differ"
LATE = 0.7  # times what is left without a delay may be left with it
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
        q, seen = seen_beside(motion, stream)
        if len(q) >= FEWEST_POINTS:
            delay, told = _late(robot, target, motion, stream)
            if told:
                q, seen = seen_beside(motion, stream, delay)
            notices += told + _check_target(robot, target, q, seen) + _moved(robot, target, motion, stream, delay)
    return notices


def seen_beside(motion: JointMotion, stream: Stream, delay: float = 0.0) -> tuple[Array, Array]:
    """Some hundred positions of the joints, shape (m, n), and of a target at the same instants, shape (m, 3).

    Args:
        motion: of the joints.
        stream: what the tracker measured.
        delay: by how much its stamps are late [s].
    """
    taken = stream.times - delay
    inside = np.flatnonzero((motion.times >= taken[0]) & (motion.times <= taken[-1]))
    chosen = inside[:: max(len(inside) // MOST_POINTS, 1)]
    seen = [np.interp(motion.times[chosen], taken, column) for column in stream.values.T]
    return motion.q[chosen], np.column_stack(seen)


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


def _late(robot: Robot, target: PositionTarget, motion: JointMotion, stream: Stream) -> tuple[float, list[Notice]]:
    """Delay of a tracker that is late, or early, which the robot file does not know [s], and what is said of it.

    Springs put a target elsewhere with the acceleration, a delay with the velocity. Zero where the best delay does not
    leave much less than none.
    """
    if any(here.owner == target.name and isinstance(here.effect, TimeShift) for here in robot.effects):
        return 0.0, []
    now = _left_at(robot.tree, target, motion, stream, 0.0)
    if now < NOISE * target.sigma:
        return 0.0, []
    tried = STEP * np.arange(-round(LATEST / STEP), round(LATEST / STEP) + 1)
    found = np.array([_left_at(robot.tree, target, motion, stream, float(delay)) if delay else now for delay in tried])
    k = int(np.argmin(found))
    if tried[k] == 0.0 or found[k] > LATE * now:
        return 0.0, []
    delay = float(tried[k])
    if 0 < k < len(tried) - 1:
        bend = found[k - 1] ** 2 - 2.0 * found[k] ** 2 + found[k + 1] ** 2
        delay += 0.5 * STEP * float((found[k - 1] ** 2 - found[k + 1] ** 2) / max(bend, 1e-300))
    springs = ", some of which may be due to springs" if robot.layout.motors else ""
    early, below = ("late", "") if delay > 0.0 else ("early", BELOW_ZERO)
    text = (
        f"{target.name} is {early}, by about {1e3 * abs(delay):.2g} ms{springs}: with it {1e3 * found[k]:.3g} mm of "
        f"{1e3 * now:.3g} mm are left between tracker and motors (rms); put {DELAY}@{target.name} into the robot file "
        f"(`jointscope add`), and the calibration finds the delay{below}"
    )
    return delay, [Notice(target.name, LATE_TRACKER, len(stream), text)]


def _moved(robot: Robot, target: PositionTarget, motion: JointMotion, stream: Stream, delay: float) -> list[Notice]:
    """What is said of a tracker that was moved: its positions jump against those of the link, and stay there."""
    taken = stream.times - delay
    inside = (taken >= motion.times[0]) & (taken <= motion.times[-1])
    times, seen = stream.times[inside], stream.values[inside]
    if len(times) < FEWEST_POINTS:
        return []
    q = np.column_stack([np.interp(taken[inside], motion.times, column) for column in motion.q.T])
    places = body_point(robot.tree, target.body, target.seen(robot.values)[0], q).value
    T = base_from_tracker(places, seen)[0]
    away, step = seen @ T[:3, :3].T + T[:3, 3] - places, np.diff(times)
    moves = np.diff(away, axis=0)
    jumps = np.linalg.norm(moves[1:-1] - 0.5 * (moves[:-2] + moves[2:]), axis=1)
    jumps[step[1:-1] > 2.0 * np.median(step)] = 0.0  # after a gap it may be anywhere
    k = int(np.argmax(jumps)) + 1
    usual = max(JUMP * float(np.quantile(jumps, USUAL_SHARE)), NOISE * target.sigma)
    before, after = away[max(k + 1 - BESIDE, 0) : k + 1], away[k + 1 : k + 1 + BESIDE]
    lasting = float(np.linalg.norm(np.median(after, axis=0) - np.median(before, axis=0)))
    if min(jumps[k - 1], lasting) < usual:
        return []
    text = (
        f"{target.name} jumps by {1e3 * np.linalg.norm(moves[k]):.2g} mm against {target.body} at {times[k + 1]:.2f} s "
        "and stays there: its tracker was moved, or the target slipped; use the part before or after it (--leave-out)"
    )
    return [Notice(target.name, MOVED_TRACKER, len(stream), text)]


def _left_at(tree: RigidTree, target: PositionTarget, motion: JointMotion, stream: Stream, delay: float) -> float:
    """What is left between tracker and motors wherever both are, with stamps late by a delay [s], rms [m]."""
    q, seen = seen_beside(motion, stream, delay)
    point = body_point(tree, target.body, np.zeros(3), q)
    return tracker_and_shift(point.value, point.R_base_body, seen, target.at, FEW_ROUNDS)[2]


def _check_target(robot: Robot, target: PositionTarget, q: Array, seen: Array) -> list[Notice]:
    tree, place = robot.tree, f"sensors.{target.name}"
    at, R, origin, _ = target.seen(robot.values)
    places = body_point(tree, target.body, at, q).value
    expected = (places - origin) @ R
    size, wanted, noise = _spread(seen), _spread(expected), NOISE * target.sigma
    if wanted > noise and not 1.0 / SAME_SIZE < size / wanted < SAME_SIZE:
        _check_unit(target, size / wanted)
    if size < noise:
        return []
    point = body_point(tree, target.body, np.zeros(3), q)
    _check_hand(target, places, seen)
    if tracker_and_shift(point.value, point.R_base_body, seen, at)[2] > max(ODD * size, noise):
        left = fitted_tracker(tree, target.body, at, q, seen)[2]
        if left > max(ODD * size, noise):
            raise RecordingError(_wrong_link(tree, target, q, seen, left, size))
    distance = float(np.sqrt(np.mean(np.sum((expected - seen) ** 2, axis=1))))
    if distance <= max(ELSEWHERE * size, noise):
        return []
    T, after, _ = base_from_tracker(places, seen)
    if _is_expected(robot, target, T, R, origin):
        return []
    text = (
        f"{target.name} is {distance:.3g} m (rms) away from where {robot.path.name} expects it; its tracker may stand "
        f"elsewhere: with sensors.{target.tracker}.tracker_pose: {[[round(x, 5) for x in row] for row in T.tolist()]} "
        f"instead of what {place} says, {after:.3g} m are left"
    )
    return [Notice(target.name, "unit", 0, text)]


def _check_hand(target: PositionTarget, points: Array, seen: Array) -> None:
    """Raises where nothing but a mirror image fits the places of the target, shape (m, 3) [m].

    Motion in a plane does not tell; nor does that of a target whose place on its link is not known: it may be mirrored,
    too.
    """
    _, left, _ = base_from_tracker(points, seen)
    T, mirrored, _ = base_from_tracker(points, seen * RIGHT_FROM_LEFT)
    if left < NOISE * target.sigma or mirrored > MIRRORED * left:
        return
    pose = [[round(x, 5) for x in row] for row in T.tolist()]
    flip = "no `left_handed`" if target.source.scale else "`left_handed: true`"
    raise RecordingError(
        f"{target.name}: only a mirror image of its positions fits the motion of {target.body} ({mirrored:.3g} m "
        f"instead of {left:.3g} m are left, rms): the axes of its tracker are left-handed, two of its columns are "
        "exchanged, or a joint before it counts the other way round than the URDF. For the first, "
        f"set {flip} of sensors.{target.name} in the robot file (x is turned over when it is read) and "
        f"tracker_pose: {pose}, or mend the columns"
    )


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
