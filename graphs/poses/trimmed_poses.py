# SPDX-License-Identifier: BSD-3-Clause
"""Poses that do not fit, found from a fit that they have no part in: several of them hide each other in a fit of all.

Least trimmed squares (Rousseeuw and Van Driessen, Technometrics 41, 1999) on linearised poses: fits to few poses drawn
by chance, each improved by the poses that are nearest to it, until one is found whose nearest four fifths are as near
as they get. From these on, poses are let in or out by how far they are from what the others predict.

Of a pose that shows several targets, one may be off while the others fit: then it alone is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.linear_poses import LinearPoses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.seen_targets import SeenTargets
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
CHANCE = 1e-4  # of a pose that fits to be left out
STARTS, BEST = 200, 5  # fits to few poses, and how many of them are improved to the end
ROUNDS = 20
HIDDEN = 2.0  # times the power that a fit of all poses leaves, or nothing was hidden in it
SMALL = 0.6  # share of the poses that a start may need
OUTLYING = 21.1  # squared distance in sigmas that one pose in ten thousand exceeds (chi2 of 3 degrees of freedom)
MOST_OUT = 0.2  # share of the poses that may be left out


@dataclass(frozen=True)
class Outlier:
    """A pose that was left out, or one of its targets.

    Attributes:
        path: of the session.
        pose: its name.
        sigmas: distance of the pose.
        target: that alone was left out; empty where the whole pose was.
    """

    path: str
    pose: str
    sigmas: float
    target: str = ""

    @property
    def name(self) -> str:
        """Pose and target as one text."""
        return f"{self.pose} ({self.target})" if self.target else self.pose


@dataclass(frozen=True)
class _Fit:
    """Values of a fit to some poses.

    Attributes:
        r: what it leaves, shape (m, k) [sigma].
        K: its covariance with noise one, shape (p, p).
        told: number of values that the poses decide, not their priors.
        cost: of what ties the values.
    """

    r: Array
    K: Array
    told: float
    cost: float

    @property
    def squares(self) -> Array:
        return np.asarray(np.sum(self.r**2, axis=1))


class TrimmedPoses:
    """Poses linearised at the values of a fit of all.

    Args:
        robot: with these values.
        problems: the sessions.
        calibrations: of each session.
        most: share of the poses that may be left out.
    """

    def __init__(
        self, robot: Robot, problems: Sequence[PoseSet], calibrations: Sequence[Calibration], most: float
    ) -> None:
        self._problems = problems
        self._linear = LinearPoses.at(robot, problems, calibrations)
        self._r = self._linear.r.reshape(-1, self._linear.rows)
        self._J = self._linear.J.reshape(*self._r.shape, -1)
        self._measured = self._linear.measured.astype(np.float64)
        self._each = float(self._measured.mean())
        self._most = most

    def outlying(self) -> tuple[Array, list[str]]:
        """Distance of each pose from what the others predict, shape (m,) [sigma]; 0 of those that fit.

        Returns:
            Beside it of each pose the name of the target that alone is off; empty where it is the whole pose.
        """
        m, none = len(self._r), (np.zeros(len(self._r)), [""] * len(self._r))
        few = int(np.ceil(self._fit(np.ones(m, bool)).told / self._each)) + 1
        keep = m - int(self._most * m)
        if few > SMALL * m or keep == m:
            return none
        inside = self._nearest_of_all(few, keep)
        for _ in range(ROUNDS):
            squares, limit = self._predicted(inside)
            if np.array_equal(squares < limit, inside):
                break
            inside = squares < limit
            if inside.sum() < keep:
                return none  # no few poses that do not fit, but an arm that is another one
        if self._noise(np.ones(m, bool)) < HIDDEN * self._noise(inside):
            return none  # nothing that a fit of all poses would not show, too
        return np.where(inside, 0.0, np.sqrt(squares)), self._odd(inside)

    def _odd(self, inside: Mask) -> list[str]:
        """Of each pose that is not inside the target that alone is off, or nothing."""
        fit, noise, found, i = self._fit(inside), self._noise(inside), [], 0
        for problem in self._problems:
            k = problem.targets.there.shape[1]
            for pose in range(len(problem.poses)):
                if inside[i]:
                    found.append("")
                else:
                    J, V = self._J[i, :k], np.linalg.inv(self._linear.whiten[i, :k, :k])
                    C = noise * V @ (np.eye(k) + J @ fit.K @ J.T) @ V.T
                    found.append(odd_target(problem.targets, pose, V @ fit.r[i, :k], C, OUTLYING))
                i += 1
        return found

    def _fit(self, inside: Mask) -> _Fit:
        linear, J = self._linear, self._J[inside].reshape(-1, self._J.shape[2])
        H = J.T @ J
        K = np.asarray(np.linalg.inv(H + linear.tied), dtype=np.float64)
        step = -K @ (J.T @ self._r[inside].reshape(-1) + linear.pull)
        cost = float(step @ (linear.tied @ step + 2.0 * linear.pull))
        return _Fit(self._r + self._J @ step, K, float(np.sum(H * K)), cost)

    def _nearest_of_all(self, few: int, keep: int) -> Mask:
        """The poses of the best trimmed fit."""
        rng, m = np.random.default_rng(0), len(self._r)
        tried = []
        for _ in range(STARTS):
            inside = np.zeros(m, bool)
            inside[rng.choice(m, few, replace=False)] = True
            tried.append(self._nearer(self._nearer(inside, keep)[1], keep))
        tried.sort(key=lambda found: found[0])
        best = tried[:BEST]
        for i, (cost, inside) in enumerate(best):
            for _ in range(ROUNDS):
                before, (cost, inside) = cost, self._nearer(inside, keep)
                if cost >= before:
                    break
            best[i] = (cost, inside)
        return min(best, key=lambda found: found[0])[1]

    def _nearer(self, inside: Mask, keep: int) -> tuple[float, Mask]:
        """Cost of a fit to some poses at those nearest to it, and which these are."""
        fit = self._fit(inside)
        nearest = np.argsort(fit.squares * (self._each / self._measured))[:keep]
        found = np.zeros(len(inside), bool)
        found[nearest] = True
        return float(fit.squares[nearest].sum()) + fit.cost, found

    def _predicted(self, inside: Mask) -> tuple[Array, Array]:
        """Squared distance of each pose from what the others among some poses predict, and its limit [sigma^2].

        The noise is that of these poses.
        """
        fit = self._fit(inside)
        spread = self._J @ fit.K @ np.swapaxes(self._J, 1, 2)
        C = np.eye(self._r.shape[1]) + np.where(inside, -1.0, 1.0)[:, None, None] * spread
        squares = np.einsum("mk,mk->m", fit.r, np.linalg.solve(C, fit.r[:, :, None])[:, :, 0]) / self._noise(inside)
        free = max(float(self._measured[inside].sum()) - fit.told, 1.0)
        return np.asarray(squares), self._measured * f.isf(CHANCE, self._measured, free)

    def _noise(self, inside: Mask) -> float:
        """Power of what some poses leave [sigma^2]; they are the nearest, so what it would be of all is more."""
        fit, share, each = self._fit(inside), float(inside.mean()), self._each
        nearest = float(chi2.cdf(chi2.ppf(share, each), each + 2.0)) / share
        free = max(float(self._measured[inside].sum()) - fit.told, 1.0)
        return float(fit.squares[inside].sum()) / (free * nearest)


def squared_distances(problem: PoseSet, calibration: Calibration) -> Array:
    """Squared distance of each pose in sigmas, transmissions and noise of the target together, shape (m,)."""
    point = problem.point(calibration)
    r = problem.misses(point, calibration)
    return np.asarray(np.einsum("mk,mk->m", r, np.linalg.solve(problem.covariances(point), r[:, :, None])[:, :, 0]))


def as_one_target(coordinates: NDArray[np.intp]) -> Array:
    """What makes squared distances of so many coordinates as unlikely as those of three."""
    return np.asarray(chi2.isf(CHANCE, 3) / chi2.isf(CHANCE, coordinates))


def odd_target(seen: SeenTargets, pose: int, r: Array, C: Array, limit: float) -> str:
    """The target without which a pose fits; empty where there is none.

    Args:
        seen: what was seen.
        pose: number of the pose.
        r: what is missed in it, shape (k,).
        C: its covariance, shape (k, k).
        limit: squared distance, as of one target, from which a pose does not fit.
    """
    there, owners, best = seen.there[pose], np.array(seen.owners), ("", limit)
    names = list(dict.fromkeys(owners[there].tolist()))
    for name in names if len(names) > 1 else []:
        rest = there & (owners != name)
        square = float(r[rest] @ np.linalg.solve(C[np.ix_(rest, rest)], r[rest]))
        square *= float(as_one_target(np.array(rest.sum())))
        best = (name, square) if square < best[1] else best
    return best[0]


def without_outliers(
    problems: Sequence[PoseSet], known: Sequence[Calibration], distances: Sequence[Array], limit: float
) -> tuple[list[PoseSet], list[Outlier]]:
    """The sessions without poses beyond a limit, or without their targets that are off alone.

    The worst ones first, for they pull others along.

    Args:
        problems: the sessions.
        known: calibrations of each.
        distances: squared, of each pose, as of one target, shape (m,) each.
        limit: of these.
    """
    kept, out = [], []
    for problem, calibration, squares in zip(problems, known, distances, strict=True):
        far, point = np.flatnonzero(squares > limit), problem.point(calibration)
        r, C = problem.misses(point, calibration), problem.covariances(point)
        odd = [""] * len(squares)
        for i in far:
            odd[i] = odd_target(problem.targets, int(i), r[i], C[i], limit)
        problem, found = _without(problem, far, odd, np.sqrt(squares))
        kept.append(problem)
        out += found
    return kept, out


def with_fitted(robot: Robot, known: Sequence[Calibration]) -> Robot:
    """A robot with the values of a fit."""
    return robot.with_values(known[0].by_name)


def without_hidden(
    robot: Robot, problems: Sequence[PoseSet], known: Sequence[Calibration]
) -> tuple[list[PoseSet], list[Outlier]]:
    """The sessions without poses, or targets of them, that hide each other in a fit of all."""
    sigmas, odd = TrimmedPoses(with_fitted(robot, known), problems, known, MOST_OUT).outlying()
    kept, out, start = [], list[Outlier](), 0
    for problem in problems:
        mine = slice(start, start + len(problem.poses))
        problem, found = _without(problem, np.flatnonzero(sigmas[mine]), odd[mine], sigmas[mine])
        kept.append(problem)
        out += found
        start = mine.stop
    return kept, out


def _without(
    problem: PoseSet, far: NDArray[np.intp], odd: Sequence[str], sigmas: Array
) -> tuple[PoseSet, list[Outlier]]:
    """A session without some poses, or without their odd targets."""
    poses, kept = problem.poses, np.ones(len(problem.poses), bool)
    kept[[i for i in far if not odd[i]]] = False
    hidden = {name: np.array([i in far and odd[i] == name for i in range(len(poses))]) for name in set(odd) - {""}}
    out = [Outlier(poses.path, poses.names[i], float(sigmas[i]), odd[i]) for i in far]
    seen = poses.without(hidden, problem.targets.first) if hidden else poses
    return replace(problem, poses=seen.only(kept)), out
