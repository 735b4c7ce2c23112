# SPDX-License-Identifier: BSD-3-Clause
"""Contacts that do not hold one target at one point: two balls, one that was mounted anew, a plate that moved.

Of two targets before anything is computed:

    p_i + A_i s = c,    s = one of two shifts of the target on the tool, c = the point of the contact of pose i

With one s for all poses they leave centimetres, with two they fit. Which pose has which is found from starts that
three poses of a contact determine, and improved in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.robots.bodies.misplaced_joints import LENGTHS
from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.error_parameters import TOOL

Array = NDArray[np.float64]
FAR = 0.01  # [m] that geometry of an arm does not leave, so that less is no second target
MUCH_BETTER = 0.5  # of what one target leaves; two shifts for one real ball leave 0.8
FEWEST = 4  # poses with each
STARTS, ROUNDS = 60, 20
DRAWN = 3  # poses that tell a shift and the point of their contact
LOOSE = 1e-3  # [1] of shifts against poses that do not tell them
SHOWN = 5


@dataclass(frozen=True)
class _Sockets:
    """Poses with the target somewhere in a contact.

    Attributes:
        target: where the robot file has it, shape (m, 3) [m].
        turns: what a shift of it does, shape (m, 3, 3).
        contacts: number of the contact of each pose, shape (m,).
    """

    target: Array
    turns: Array
    contacts: NDArray[np.intp]

    def shifts(self, which: NDArray[np.intp], count: int) -> Array:
        """Of targets, given which one each pose has, shape (count, 3) [m]; points of contacts are where they fit."""
        A, b = np.zeros((len(which), 3, 3 * count)), -self.target
        for k in range(count):
            A[which == k, :, 3 * k : 3 * k + 3] = self.turns[which == k]
        for c in np.unique(self.contacts):
            mine = self.contacts == c
            A[mine] -= A[mine].mean(axis=0)
            b[mine] -= b[mine].mean(axis=0)
        H = np.einsum("mij,mik->jk", A, A) + LOOSE * np.eye(3 * count)
        return np.asarray(np.linalg.solve(H, np.einsum("mij,mi->j", A, b)).reshape(count, 3))

    def only(self, some: NDArray[np.intp]) -> _Sockets:
        """Some of the poses."""
        return _Sockets(self.target[some], self.turns[some], self.contacts[some])

    def nearest(self, shifts: Array) -> NDArray[np.intp]:
        """Which target each pose has, where the points of contacts are those that most poses are near to."""
        places = self.target[:, None] + np.einsum("mij,kj->mki", self.turns, shifts)
        which = np.zeros(len(places), np.intp)
        for c in np.unique(self.contacts):
            mine = places[self.contacts == c]
            away = np.linalg.norm(mine[:, :, None] - mine.reshape(-1, 3), axis=3)
            which[self.contacts == c] = away[:, :, np.argmin(away.min(axis=1).sum(axis=0))].argmin(axis=1)
        return which

    def left(self, which: NDArray[np.intp], shifts: Array) -> float:
        """What the poses leave, rms [m]."""
        places = self.target + np.einsum("mij,mj->mi", self.turns, shifts[which])
        means = np.stack([places[self.contacts == c].mean(axis=0) for c in self.contacts])
        return float(np.sqrt(np.mean(np.sum((places - means) ** 2, axis=1))))


def screen_contacts(problem: PoseSet) -> None:
    """Looks at a session with contacts and without names of targets.

    Raises:
        RecordingError: poses fit two targets, not one.
    """
    if not problem.contacts or problem.poses.held:
        return
    sockets = _sockets(problem)
    one = np.zeros(len(sockets.target), np.intp)
    apart = sockets.left(one, sockets.shifts(one, 1))
    if apart < FAR:
        return
    which = min(_guesses(sockets), key=lambda which: sockets.left(which, sockets.shifts(which, 2)), default=one)
    which = which if which[0] == 0 else 1 - which
    shifts = sockets.shifts(which, 2)
    left = sockets.left(which, shifts)
    if min(np.bincount(which, minlength=2)) >= FEWEST and left < MUCH_BETTER * apart:
        raise RecordingError(_said(problem, which, shifts, apart, left))


def _sockets(problem: PoseSet) -> _Sockets:
    e, calibration = np.zeros_like(problem.q), Calibration.of(problem.robot).only([DYNAMICS])
    point = problem.arm.at(problem.q, e, problem.values(calibration))
    turns = np.stack([point.by_value[f"{TOOL}.{part}"] for part in LENGTHS], axis=2)
    number = {contact: i for i, contact in enumerate(problem.contacts)}
    return _Sockets(point.target, turns, np.array([number[c] for c in problem.poses.contacts]))


def _guesses(sockets: _Sockets) -> list[NDArray[np.intp]]:
    """Which pose has which of two targets, from starts by chance."""
    rng, found = np.random.default_rng(0), []
    full = [np.flatnonzero(sockets.contacts == c) for c in np.unique(sockets.contacts)]
    full = [poses for poses in full if len(poses) >= DRAWN]
    for _ in range(STARTS if full else 0):
        drawn = [rng.choice(full[rng.integers(len(full))], DRAWN, replace=False) for _ in range(2)]
        shifts = np.concatenate([sockets.only(d).shifts(np.zeros(DRAWN, np.intp), 1) for d in drawn])
        which = sockets.nearest(shifts)
        for _ in range(ROUNDS):
            before, which = which, sockets.nearest(sockets.shifts(which, 2))
            if np.array_equal(before, which):
                break
        found.append(which)
    return found


def _said(problem: PoseSet, which: NDArray[np.intp], shifts: Array, apart: float, left: float) -> str:
    setup, poses, place = problem.robot.poses, problem.poses, problem.robot.path.name
    assert setup is not None
    held = [dict.fromkeys(c for c, w in zip(poses.contacts, which, strict=True) if w == k) for k in range(2)]
    whole = not set(held[0]) & set(held[1])
    names = [list(held[k]) if whole else [poses.names[i] for i in np.flatnonzero(which == k)] for k in range(2)]
    what = "contact" if whole else "pose"
    first, second = (f"{what} {', '.join(n[:SHOWN])}{f' and {len(n) - SHOWN} more' * (len(n) > SHOWN)}" for n in names)
    at = [", ".join(f"{x:.3g}" for x in setup.at + shift) for shift in shifts]
    others = ", ".join(target.name for target in setup.targets)
    todo = f"add a column `target` with the name of the one in the contact ({others})"
    if not setup.others:
        todo = (
            f"give the second a name under `targets` of {place}, and say which is in the contact in a column `target`"
        )
    return (
        f"{poses.path}: two different targets were in the contacts, {1e3 * np.linalg.norm(shifts[1] - shifts[0]):.3g} "
        f"mm from each other on the tool, or one was mounted anew: one leaves {1e3 * apart:.2g} mm, two leave "
        f"{1e3 * left:.2g} mm: at [{at[0]}] of {setup.link} in {first}, at [{at[1]}] in {second}; {todo}"
    )


@dataclass(frozen=True)
class MovedContact:
    """Poses one after the other that were left out and are off alike: first and last, contact, how far [m]."""

    first: str
    last: str
    contact: str
    size: float


def moved_contacts(
    problems: Sequence[PoseSet], whole: Sequence[PoseSet], calibrations: Sequence[Calibration]
) -> list[MovedContact]:
    """Where a contact was elsewhere for some poses: they are off in one direction of the base, whatever the posture.

    Args:
        problems: the sessions without poses that were left out.
        whole: with them.
        calibrations: of each.
    """
    found = list[MovedContact]()
    for problem, all_of_it, calibration in zip(problems, whole, calibrations, strict=True):
        session, held = replace(problem, poses=all_of_it.poses), all_of_it.poses.contacts
        if not held or session.contacts != problem.contacts:
            continue
        off = session.misses(session.point(calibration), calibration)
        out, i = ~np.isin(session.poses.shares, problem.poses.shares), 0
        while i < len(off):
            k = i
            while k < len(off) and out[k] and held[k] == held[i] and _alike(off[i : k + 1]):
                k += 1
            if k - i >= FEWEST:
                size, names = float(np.linalg.norm(off[i:k].mean(axis=0))), session.poses.names
                found.append(MovedContact(names[i], names[k - 1], held[i], size))
            i = max(k, i + 1)
    return found


def _alike(off: Array) -> bool:
    """Whether all are nearer to their mean than half its length."""
    mean = off.mean(axis=0)
    return bool(np.all(np.linalg.norm(off - mean, axis=1) < 0.5 * np.linalg.norm(mean)))
