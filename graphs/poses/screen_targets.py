# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes in several targets and in their orientations: names exchanged, places on the tool, conventions.

An orientation that a tracker tells is R_tracker_target = R_tracker_tool X with one X in all poses. Where no X fits,
each of the usual other conventions is tried.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.seen_targets import Mount, mounts
from jointscope.graphs.poses.tracker_start import is_open, predicted_places, tool_seen, tracker_by
from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.error_parameters import TOOL
from jointscope.robots.geometry.rotations import (
    mean_rotation,
    of_quaternions,
    of_roll_pitch_yaw,
    quaternion_xyzw,
    roll_pitch_yaw,
    rotation_vectors,
    spread,
)
from jointscope.robots.geometry.tracker_fit import base_from_tracker
from jointscope.robots.recordings.poses import Poses, Sighting

Array = NDArray[np.float64]
FEWEST = 6  # sightings that tell a mistake from chance
FAR = 0.01  # [m] names of targets that fit to less are right
MUCH_BETTER = 0.2  # of what is left, where names that were exchanged fit
LARGEST_ERROR = 0.05  # [m] that errors of an arm can make
LARGEST_TURN = 0.1  # [rad] the same
ROUNDS = 20  # of turns before and behind the arm's
SAME = 1e-6  # [rad]
FEW = 0.2  # share of the sightings that may be wrong by themselves
MILLI = (500.0, 2000.0)  # times as far apart as the arm puts them: millimetres
LIKELY = 0.05  # [rad] that axes may be away from those that are named


def screen_targets(problem: PoseSet) -> None:
    """Looks at the targets of a session.

    Raises:
        RecordingError: something is plainly wrong.
    """
    if problem.poses.target is None or problem.targets.plain:
        return
    for sighting in problem.targets.sightings:
        check_lost(problem.poses, sighting.place, f"the target {sighting.name}", "rows")
    found, places = mounts(problem.robot), predicted_places(problem)
    _check_units(problem, places)
    known = [s for s in problem.targets.sightings if _is_known(problem, found[s.name])]
    for one, other in combinations(known, 2):
        _check_names(problem, places, one, other)
    for one, other in combinations(problem.targets.sightings, 2):
        _check_some_names(problem, places, one, other)
    _check_contradictions(problem, known)


def check_lost(poses: Poses, places: Array, target: str, what: str) -> None:
    """Looks for poses in which a target is at the very zero that trackers give when they see none.

    Args:
        poses: the session.
        places: of the target in each pose, shape (m, 3) [m].
        target: what it is called in a message.
        what: of the session should be removed.

    Raises:
        RecordingError: there are some.
    """
    lost = [poses.names[i] for i in np.flatnonzero(np.all(places == 0.0, axis=1))]
    if lost:
        raise RecordingError(
            f"{poses.path}: {target} is at exactly zero in pose {', '.join(lost[:5])}{' and more' * (len(lost) > 5)}: "
            f"the tracker had lost it; remove these {what}"
        )


def screen_tool(problem: PoseSet) -> None:
    """Looks at the place of further targets on the tool and at orientations, where the first target fits.

    Raises:
        RecordingError: something is plainly wrong.
    """
    if problem.poses.target is None or problem.targets.plain:
        return
    found = mounts(problem.robot)
    for sighting in problem.targets.sightings:
        mount = found[sighting.name]
        if mount.owner != TOOL and _is_known(problem, mount):
            _check_place(problem, sighting, mount)
        if sighting.turn is not None:
            _check_turns(problem, sighting, sighting.turn, mount)


def _is_known(problem: PoseSet, mount: Mount) -> bool:
    return mount.owner == TOOL or not is_open(problem.robot, mount.owner)


def _check_units(problem: PoseSet, places: Mapping[str, Array]) -> None:
    """Some targets may be in millimetres; where all are, that is told of the first."""
    assert problem.robot.poses is not None
    (tool, _), found, wrong = tool_seen(problem), mounts(problem.robot), []
    unknown = {target.name for target in problem.robot.poses.targets if target.at is None}
    for s in problem.targets.sightings:
        there = np.isfinite(s.place[:, 0])
        # a place on the tool that was found from these very positions says nothing of their unit
        expected = found[s.name].on(tool).target if s.name in unknown else places[s.name]
        apart = [float(np.linalg.norm(np.std(x[there], axis=0))) for x in (s.place, expected)]
        if there.sum() >= FEWEST and MILLI[0] < apart[0] / max(apart[1], 1e-12) < MILLI[1]:
            wrong.append(s.name)
    if wrong and len(wrong) < len(problem.targets.sightings):
        raise RecordingError(
            f"{problem.poses.path}: places of {', '.join(wrong)} are about 1000 times as far apart as those of the "
            "other targets, as in millimetres; expected one unit for all, in a table that of poses.positions"
        )


def _some(problem: PoseSet, far: NDArray[np.bool_]) -> str:
    """Names of some poses."""
    names = [problem.poses.names[i] for i in np.flatnonzero(far)]
    return ", ".join(names[:5]) + f" and {len(names) - 5} more" * (len(names) > 5)


def _check_some_names(problem: PoseSet, places: Mapping[str, Array], one: Sighting, other: Sighting) -> None:
    """Two targets may have each other's name in some poses: the way from one to the other is turned round there."""
    there = np.isfinite(one.place[:, 0]) & np.isfinite(other.place[:, 0])
    predicted, seen = places[one.name] - places[other.name], one.place - other.place
    with np.errstate(invalid="ignore"):
        right, turned = (np.linalg.norm(seen - sign * predicted, axis=1) for sign in (1.0, -1.0))
        wrong = there & (right > FAR) & (turned < MUCH_BETTER * right)
    if there.sum() >= FEWEST and 0 < wrong.sum() <= 0.5 * there.sum():
        raise RecordingError(
            f"{problem.poses.path}: the targets {one.name} and {other.name} seem to be exchanged in pose "
            f"{_some(problem, wrong)}: the way from one to the other is turned round there; correct their names"
        )


def _check_names(problem: PoseSet, places: Mapping[str, Array], one: Sighting, other: Sighting) -> None:
    """Two targets may have each other's name: with both the other way round a tracker fits somewhere."""
    there = np.isfinite(one.place[:, 0]) & np.isfinite(other.place[:, 0])
    if there.sum() < FEWEST:
        return
    predicted = np.concatenate([places[s.name][there] for s in (one, other)])
    seen = [one.place[there], other.place[there]]
    left, exchanged = (base_from_tracker(predicted, np.concatenate(each))[1] for each in (seen, seen[::-1]))
    if left > FAR and exchanged < MUCH_BETTER * left:
        raise RecordingError(
            f"{problem.poses.path}: the targets {one.name} and {other.name} seem to be exchanged: with both the other "
            f"way round the arm fits to {1e3 * exchanged:.2g} mm instead of {1e3 * left:.3g} mm; check the names in "
            f"the table, or in `targets` of {problem.robot.path.name}"
        )


def _check_contradictions(problem: PoseSet, known: list[Sighting]) -> None:
    """Where poses themselves place the tracker, a target that is elsewhere drags it along: without it, others fit."""
    if not problem.own_tracker or len(known) < 2:
        return
    _, left = tracker_by(problem, known)
    for odd in reversed(known[1:]):
        tracker, without = tracker_by(problem, [s for s in known if s is not odd])
        if left > LARGEST_ERROR and without < min(MUCH_BETTER * left, LARGEST_ERROR / 5.0):
            _check_place(replace(problem, tracker=tracker), odd, mounts(problem.robot)[odd.name])


def _check_place(problem: PoseSet, sighting: Sighting, mount: Mount) -> None:
    point = mount.on(tool_seen(problem)[0])
    there = np.isfinite(sighting.place[:, 0])
    away = (sighting.place - predicted_places(problem)[sighting.name])[there]
    misses = float(np.sqrt(np.mean(np.sum(away**2, axis=1))))
    if there.sum() < FEWEST or misses < LARGEST_ERROR:
        return
    on_link = np.einsum("mji,mj->mi", point.turn[there] @ mount.R_link, away)
    far = np.zeros(len(there), bool)
    far[there] = _few_far(np.linalg.norm(on_link - np.median(on_link, axis=0), axis=1), LARGEST_ERROR)
    if np.any(far):
        raise RecordingError(
            f"{problem.poses.path}: the target {sighting.name} is off by up to "
            f"{1e3 * np.linalg.norm(away, axis=1).max():.3g} mm in pose {_some(problem, far)} and fits in the others: "
            "something else was seen there; correct or remove these rows"
        )
    shift = on_link.mean(axis=0)
    left = float(np.sqrt(np.mean(np.sum((on_link - shift) ** 2, axis=1))))
    assert problem.robot.poses is not None
    target = next(target for target in problem.robot.poses.targets if target.name == sighting.name)
    hint = "check the names of the targets, and the link that carries it"
    where = "the tool" if mount.joint is None else target.link
    if left < LARGEST_ERROR / 5.0 and target.at is not None:
        x, y, z = (f"{v:.3g}" for v in target.at + shift)
        hint = (
            f"at [{x}, {y}, {z}] of {target.link} it fits to {1e3 * left:.2g} mm; leave out its `at`, and it is found"
        )
    raise RecordingError(
        f"{problem.poses.path}: the target {sighting.name} is not where {problem.robot.path.name} has it on {where}, "
        f"it is off by {1e3 * misses:.3g} mm; {hint}"
    )


def _check_turns(problem: PoseSet, sighting: Sighting, measured: Array, mount: Mount) -> None:
    there = np.isfinite(measured[:, 0, 0])
    if there.sum() < FEWEST:
        return
    G, M = (mount.on(tool_seen(problem)[0]).turn @ mount.R_link)[there], measured[there]
    name, path = sighting.name, problem.poses.path
    left = _fits(G, M)
    far = np.zeros(len(there), bool)
    far[there] = _few_far(_off_the_others(np.swapaxes(G, 1, 2) @ M), LARGEST_TURN)
    if np.any(far):
        raise RecordingError(
            f"{path}: the orientation of {name} is off by more than {LARGEST_TURN:g} rad in pose "
            f"{_some(problem, far)} and fits in the others; correct it there, or leave its cells empty"
        )
    if left > LARGEST_TURN:
        raise RecordingError(
            f"{path}: the orientations of {name} are off by {left:.2g} rad (rms) from any that turns with the tool; "
            + _other_convention(G, M)
        )
    mean = mean_rotation(np.swapaxes(G, 1, 2) @ M)
    off = float(np.linalg.norm(rotation_vectors((mount.R_target.T @ mean)[None])))
    if off > LARGEST_TURN:
        x, y, z, w = quaternion_xyzw(mean)
        raise RecordingError(
            f"{path}: {name} is not oriented on the tool as {problem.robot.path.name} says, off by {off:.2g} rad; "
            f"[{x:.3g}, {y:.3g}, {z:.3g}, {w:.3g}] would fit; leave out its `orientation`, and it is found"
        )


def _few_far(away: Array, most: float) -> NDArray[np.bool_]:
    """Which of some distances are large, shape (s,), if they are few and most of the others are small."""
    far = away > most
    few = far.sum() <= FEW * len(far) and np.median(away) < most / 5.0
    return np.asarray(far if few else np.zeros_like(far))


def _off_the_others(X: Array) -> Array:
    """Angles of rotations of shape (s, 3, 3) from the mean of those that are near it, shape (s,) [rad]."""
    kept, away = np.ones(len(X), bool), np.zeros(len(X))
    for _ in range(ROUNDS):
        away = np.linalg.norm(rotation_vectors(mean_rotation(X[kept]).T @ X), axis=1)
        kept = away <= max(3.0 * float(np.median(away)), SAME)
    return np.asarray(away)


def _fits(G: Array, M: Array) -> float:
    """How far X of M = G X is from the same in all poses, root mean square [rad]."""
    return spread(np.swapaxes(G, 1, 2) @ M)


def _other_convention(G: Array, M: Array) -> str:
    """What would fit instead."""
    ordered = of_quaternions(np.array([np.roll(quaternion_xyzw(R), -1) for R in M]))
    if _fits(G, ordered) < LARGEST_TURN:
        return "in the order w, x, y, z they fit: exchange the columns, expected qx, qy, qz, qw"
    if _fits(G, np.swapaxes(M, 1, 2)) < LARGEST_TURN:
        return (
            "their inverses fit, as of the tracker in the axes of the target: expected the target in the axes of the "
            "tracker, give -qx, -qy, -qz, qw"
        )
    if _fits(G, np.swapaxes(ordered, 1, 2)) < LARGEST_TURN:
        return (
            "their inverses in the order w, x, y, z fit: expected qx, qy, qz, qw of the target in axes of the tracker"
        )
    Z, left = _turned_axes(G, M)
    if left > LARGEST_TURN:
        return "no other convention fits: check that they are of this target, or leave them out"
    for k, axis in enumerate("xyz"):
        if np.linalg.norm(rotation_vectors((np.diag(2.0 * np.eye(3)[k] - 1.0) @ Z)[None])) < LIKELY:
            return (
                f"they are those of axes with {axis} the other way, as of a left-handed tracker, while its positions "
                "are right-handed; expected both in the same right-handed axes"
            )
    roll, pitch, yaw = np.rad2deg(roll_pitch_yaw(Z))
    return (
        f"they fit in axes that are turned by roll {roll:.0f}, pitch {pitch:.0f}, yaw {yaw:.0f} degrees against those "
        "of the positions; expected both in the axes of the tracker"
    )


def _turned_axes(G: Array, M: Array) -> tuple[Array, float]:
    """Z of M = Z G X with any X, in turn from turns by right angles, and what is left [rad]."""
    best = np.eye(3), np.inf
    for roll, pitch, yaw in product(range(4), (0, 1, 3), range(4)):
        Z = of_roll_pitch_yaw(*(0.5 * np.pi * angle for angle in (roll, pitch, yaw)))
        for _ in range(ROUNDS):
            X = mean_rotation(np.swapaxes(Z @ G, 1, 2) @ M)
            Z = mean_rotation(M @ np.swapaxes(G @ X, 1, 2))
        left = _fits(Z @ G, M)
        if left < best[1]:
            best = Z, left
    return best
