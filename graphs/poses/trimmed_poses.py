# SPDX-License-Identifier: BSD-3-Clause
"""Poses that do not fit, found from a fit that they have no part in: several of them hide each other in a fit of all.

Least trimmed squares (Rousseeuw and Van Driessen, Technometrics 41, 1999) on linearised poses: fits to few poses drawn
by chance, each improved by the poses that are nearest to it, until one is found whose nearest four fifths are as near
as they get. From these on, poses are let in or out by how far they are from what the others predict.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.linear_poses import LinearPoses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
CHANCE = 1e-4  # of a pose that fits to be left out
STARTS, BEST = 200, 5  # fits to few poses, and how many of them are improved to the end
ROUNDS = 20
HIDDEN = 2.0  # times the power that a fit of all poses leaves, or nothing was hidden in it
SMALL = 0.6  # share of the poses that a start may need


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
        self._linear = LinearPoses.at(robot, problems, calibrations)
        self._r = self._linear.r.reshape(-1, self._linear.rows)
        self._J = self._linear.J.reshape(*self._r.shape, -1)
        self._measured = self._linear.measured.astype(np.float64)
        self._each = float(self._measured.mean())
        self._most = most

    def outlying(self) -> Array:
        """Distance of each pose from what the others predict, shape (m,) [sigma]; 0 of those that fit."""
        m, none = len(self._r), np.zeros(len(self._r))
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
        return np.where(inside, 0.0, np.sqrt(squares))

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
