# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes in poses that are told before any physics: units, hands, lost targets, poses that are all alike, too few."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.screen_contacts import screen_contacts
from jointscope.graphs.poses.screen_targets import check_lost, screen_targets, screen_tool
from jointscope.graphs.poses.tip_errors import contact_distances
from jointscope.graphs.poses.tracker_start import tracker_and_target
from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.tracker_fit import base_from_tracker

Array = NDArray[np.float64]
FEWEST = 6
FULL_TURN = 2.0 * np.pi
LARGEST_ERROR = 0.05  # [m] that geometric errors of an arm can make
ALIKE = 1e-3  # [rad]
FEW = 0.2  # share of the poses that may be wrong by themselves
ROUNDS = 10
MUCH_BETTER = 0.2  # of what is left, where angles that were read otherwise fit


def screen_poses(problems: Sequence[PoseSet]) -> None:
    """Looks at all sessions.

    Raises:
        RecordingError: something is plainly wrong.
    """
    for problem in problems:
        _check_angles(problem)
        screen_targets(problem)
        first = problem.of_first
        if first.poses.target is not None and len(first.poses):
            _check_targets(first, first.poses.target)
        screen_tool(problem)
        screen_contacts(problem)
        _check_contacts(problem)
    _check_number(problems)


def _check_angles(problem: PoseSet) -> None:
    poses, joints = problem.poses, problem.arm.chain.joints
    largest = np.abs(problem.q).max(axis=0)
    limits = problem.robot.tree.limits[problem.arm.chain.places]
    allowed = np.where(np.isfinite(limits), np.abs(limits), FULL_TURN).max(axis=1)
    k = int(np.argmax(largest / allowed))
    if largest[k] > max(1.2 * allowed[k], 1.0):
        degrees = largest[k] * np.pi / 180.0 < 1.2 * allowed[k] and largest[k] > 3.0 * FULL_TURN / 2.0
        hint = (
            "the angles look like degrees: set `unit: deg` of poses.joint_states"
            if degrees
            else "check units and names"
        )
        raise RecordingError(
            f"{poses.path}: {joints[k]} is at {largest[k]:.4g} rad; {problem.robot.tree.urdf.name} allows "
            f"{allowed[k]:.4g} rad; {hint} in {problem.robot.path.name}"
        )
    if len(poses) > 1 and np.ptp(problem.q, axis=0).max() < ALIKE:
        raise RecordingError(f"{poses.path}: all {len(poses)} poses are alike; expected poses all over the workspace")


def _check_targets(problem: PoseSet, target: Array) -> None:
    poses, place = problem.poses, problem.robot.path.name
    check_lost(poses, target, "the target", "poses")
    if len(poses) < FEWEST:
        return
    predicted = problem.point(Calibration.of(problem.robot).only([DYNAMICS])).target
    misses = float(np.sqrt(np.mean(np.sum((predicted - target) ** 2, axis=1))))
    if misses < LARGEST_ERROR:
        return
    spread = [float(np.sqrt(np.mean(np.sum((x - x.mean(axis=0)) ** 2, axis=1)))) for x in (predicted, target)]
    ratio = spread[1] / max(spread[0], 1e-12)
    if 500.0 < ratio < 2000.0:
        raise RecordingError(
            f"{poses.path}: targets are {ratio:.4g} times as far apart as the arm puts them, as in millimetres; "
            f"expected m: "
            f"set `unit: mm` of poses.positions in {place}"
        )
    _, left, mirrored = base_from_tracker(predicted, target)
    if mirrored:
        raise RecordingError(
            f"{poses.path}: only a mirrored arm would fit: the axes of the tracker are left-handed, or two columns "
            f"of the "
            "target are exchanged; expected right-handed x, y, z"
        )
    _check_single_poses(problem, predicted, target)
    _check_joints(problem, target, left)
    if left < LARGEST_ERROR and problem.own_tracker:
        raise RecordingError(
            f"{poses.path}: the targets contradict each other: {problem.targets.first} alone fits to "
            f"{1e3 * left:.2g} mm, with the others it misses by {1e3 * misses:.3g} mm; check `link` and `at` of the "
            f"others in {place}, and their names in the table"
        )
    if left < LARGEST_ERROR:
        raise RecordingError(
            f"{poses.path}: the tracker does not stand where {place} says: another place fits to {1e3 * left:.2g} mm "
            f"instead of {1e3 * misses:.3g} mm; leave out `tracker` in the section poses, and its place is found"
        )
    _, shift, fits = tracker_and_target(problem, target)
    if fits < LARGEST_ERROR / 5.0:
        assert problem.robot.poses is not None
        x, y, z = (f"{v:.3g}" for v in problem.robot.poses.at + shift)
        raise RecordingError(
            f"{poses.path}: the target is not where {place} has it: at [{x}, {y}, {z}] of {problem.robot.poses.link} "
            f"the arm fits to {1e3 * fits:.2g} mm instead of {1e3 * left:.3g} mm; set `at` of poses to it, or "
            "`tool_sigma` to how little is known [m], and its place is estimated"
        )
    raise RecordingError(
        f"{poses.path}: the arm misses the measured targets by {1e3 * misses:.3g} mm (rms), {1e3 * left:.3g} mm "
        f"with a tracker anywhere; {_one_for_all(problem)}check names, signs and units of the joints, and the link "
        "that carries the target"
    )


def _one_for_all(problem: PoseSet) -> str:
    """That rows of several targets were all taken for the first one, as nothing says whose they are."""
    setup, poses = problem.robot.poses, problem.poses
    if setup is None or not setup.others or poses.others:
        return ""
    names = ", ".join(target.name for target in setup.targets)
    return (
        f"{problem.robot.path.name} has the targets {names}, but all rows count as {problem.targets.first}: "
        "say in a column `target` whose each row is; else "
    )


def _check_joints(problem: PoseSet, target: Array, left: float) -> None:
    """Two joints may be exchanged, or one may turn the other way."""
    e, calibration = problem.start(Calibration.of(problem.robot).only([DYNAMICS]))
    values = problem.values(calibration)

    def fits(q: Array) -> bool:
        """Whether other angles fit, and much better than those that were read, with a tracker anywhere."""
        other = base_from_tracker(problem.arm.at(q, e, values).target, target)[1]
        return other < LARGEST_ERROR and other < MUCH_BETTER * left

    joints = problem.arm.chain.joints
    for a, b in combinations(range(len(joints)), 2):
        q = problem.q.copy()
        q[:, [a, b]] = q[:, [b, a]]
        if fits(q):
            raise RecordingError(
                f"{problem.poses.path}: columns of {joints[a]} and {joints[b]} seem to be exchanged: with both the "
                f"other way round the arm fits; check the names in the table, or `names` of "
                f"poses.joint_states in {problem.robot.path.name}"
            )
    for k, joint in enumerate(joints):
        q = problem.q.copy()
        q[:, k] *= -1.0
        if fits(q):
            raise RecordingError(
                f"{problem.poses.path}: {joint} seems to turn the other way: with its sign reversed the arm fits; "
                f"check its sign in the table or bag, and its axis in {problem.robot.tree.urdf.name}"
            )


def _check_single_poses(problem: PoseSet, predicted: Array, target: Array) -> None:
    """A few poses may be wrong where all others fit."""
    kept, away = np.ones(len(target), bool), np.zeros(len(target))
    for _ in range(ROUNDS):
        T = base_from_tracker(predicted[kept], target[kept])[0]
        away = np.linalg.norm(target @ T[:3, :3].T + T[:3, 3] - predicted, axis=1)
        kept = away <= 3.0 * float(np.median(away))
    far, fits = np.flatnonzero(away > LARGEST_ERROR), float(np.median(away))
    if 0 < len(far) <= FEW * len(target) and fits < LARGEST_ERROR / 5.0:
        names = ", ".join(problem.poses.names[i] for i in far[:5])
        raise RecordingError(
            f"{problem.poses.path}: {names}{' and more' * (len(far) > 5)}: these poses are off the target "
            f"by up to {1e3 * away.max():.3g} mm, half of all fit to {1e3 * fits:.2g} mm: rows were exchanged, or "
            "another target was seen; correct or remove them"
        )


def _check_contacts(problem: PoseSet) -> None:
    """Contacts of a place are about as far apart as the robot file says."""
    said = None if problem.robot.poses is None else problem.robot.poses.contact_distance
    if said is None or not problem.contacts:
        return
    start = problem.start(Calibration.of(problem.robot))[1]
    for place, found in contact_distances(problem, start).items():
        if abs(found - said) > LARGEST_ERROR:
            raise RecordingError(
                f"{problem.poses.path}: the contacts of place {place} are {found:.3g} m apart as the arm has them, but "
                f"`contact_distance` in {problem.robot.path.name} is {said:.4g} m; expected metres, and two contacts "
                "that are that far apart"
            )


def _check_number(problems: Sequence[PoseSet]) -> None:
    """More coordinates than values, or priors decide."""
    poses = sum(len(problem.poses) for problem in problems)
    contacts = sum(len(problem.contacts) for problem in problems)
    told = sum(problem.measured for problem in problems) - 3 * contacts
    if poses < FEWEST or told < FEWEST:
        more = max(FEWEST - poses, -(-(FEWEST - told) // 3))
        at = f" at {contacts} contacts" if contacts else ""
        said = f"1 pose{at} tells" if poses == 1 else f"{poses} poses{at} tell"
        raise RecordingError(
            f"{problems[0].poses.path}: {said} {max(told, 0)} coordinates; expected at least {FEWEST} poses that tell "
            f"as many: add {more} more"
        )
