# SPDX-License-Identifier: BSD-3-Clause
"""Poses linearised at a calibrated arm, whitened: what every value, and every effect that is not there, would do.

Errors of an arm are so small that a linear step is the answer to micrometres. Fits of a model with one more effect, on
some poses or on all, are then small systems of equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.robots.geometry.added_effect import RIGID, at_null
from jointscope.robots.geometry.arm_effects import POSES, ArmHypothesis
from jointscope.robots.model.robot import Robot

if TYPE_CHECKING:  # which begins with the poses linearised here
    from jointscope.graphs.poses.calibrate_poses import PoseCalibration

Array = NDArray[np.float64]
SPREAD = 1.0  # [m] prior sigma of the point of a contact, so that one that was left out has one
FOLDS = 10


@dataclass(frozen=True)
class LinearPoses:
    """Whitened rows of all poses: residual r + J d of a step d away from the calibrated values (`LinearKind`).

    Attributes:
        r: shape (k m,) [sigma]; k rows for each pose, zero where it has fewer.
        J: columns of the values and of the points of contacts, shape (k m, p).
        tied: information on the columns from priors and known distances, shape (p, p).
        pull: slope of the cost of these, shape (p,).
        groups: number of the group of each pose, shape (m,).
        contacts: number of the contact of each pose, shape (m,); -1 where a tracker measured.
        whiten: of each pose, shape (m, k, k).
        measured: number of coordinates of each pose, shape (m,).
        off, apart: whitened residuals of known distances between contacts, shape (d,), and their columns, shape (d, p);
            `tied` and `pull` hold them, too.
        places: for each session, which of the columns are those of its calibration.
    """

    r: Array
    J: Array
    tied: Array
    pull: Array
    groups: NDArray[np.intp]
    contacts: NDArray[np.intp]
    whiten: Array
    measured: Array
    off: Array
    apart: Array
    places: tuple[NDArray[np.intp], ...]

    kind = POSES

    @staticmethod
    def of(result: PoseCalibration) -> LinearPoses:
        """The poses of a calibration at its values."""
        return LinearPoses.at(result.robot, result.problems, result.calibrations)

    @staticmethod
    def at(robot: Robot, problems: Sequence[PoseSet], calibrations: Sequence[Calibration]) -> LinearPoses:
        """Poses at some values.

        Args:
            robot: with these values.
            problems: the sessions.
            calibrations: of each session, with the points of its contacts.
        """
        shared = calibrations[0].names
        pieces, ties, places = [], [], list[NDArray[np.intp]]()
        names, held, size = list[str](), list[int](), len(shared)
        total = size + sum(problem.own_coordinates for problem in problems)
        tied = np.diag(np.full(total, SPREAD**-2.0))
        tied[:size, :size], pull = prior_information(robot, shared), np.zeros(total)
        pull[:size] = prior_pull(robot, shared)
        first = size
        for problem, calibration in zip(problems, calibrations, strict=True):
            index = calibration.columns[DYNAMICS]
            own = [k for k in range(calibration.size) if not index.start <= k < index.stop]
            place = np.zeros(calibration.size, dtype=np.intp)
            place[index], place[own] = np.arange(size), np.arange(first, first + len(own))
            W, r, J = _whitened(problem, calibration)
            wide = np.zeros((*r.shape, total))
            wide[:, :, place] = J
            off, own_apart = problem.distances(calibration)
            apart = np.zeros((len(off), total))
            apart[:, place] = own_apart
            ties.append((off, apart))
            places.append(place)
            number = {contact: first + 3 * i for i, contact in enumerate(problem.contacts)}
            held += [number[c] for c in problem.poses.contacts] or [-1] * len(problem.poses)
            names += problem.poses.groups
            first += len(own)
            pieces.append((r, wide, W, problem.targets.there.sum(axis=1)))
        groups = {name: i for i, name in enumerate(dict.fromkeys(names))}
        r, J = (filled([piece[i] for piece in pieces], 1) for i in range(2))
        W, measured = filled([piece[2] for piece in pieces], 2), np.concatenate([piece[3] for piece in pieces])
        off, apart = (np.concatenate([tie[k] for tie in ties]) for k in range(2))
        tied, pull = tied + apart.T @ apart, pull + apart.T @ off
        numbers = np.array([groups[name] for name in names])
        r, J = r.reshape(-1), J.reshape(r.size, total)
        return LinearPoses(r, J, tied, pull, numbers, np.array(held), W, measured, off, apart, tuple(places))

    @cached_property
    def fold_of(self) -> NDArray[np.intp]:
        """Fold of each pose: whole groups, every tenth one together, so that neighbours in time are apart."""
        return np.asarray(self.groups % min(FOLDS, int(self.groups.max()) + 1))

    @property
    def folds(self) -> int:
        """Number of folds."""
        return int(self.fold_of.max()) + 1

    @property
    def counted(self) -> float:
        """Number of measured coordinates."""
        return float(self.measured.sum())

    @property
    def rows(self) -> int:
        """Number of rows of each pose, k."""
        return self.whiten.shape[1]

    @cached_property
    def basis(self) -> Array:
        """Orthonormal basis of all that the columns and what ties them explain, shape (k m + p, p)."""
        return np.asarray(np.linalg.qr(np.vstack([self.J, np.linalg.cholesky(self.tied).T]))[0])

    def whitened(self, columns: Array) -> Array:
        """Columns of shape (m, k, q) as rows, shape (k m, q)."""
        return np.asarray((self.whiten @ columns).reshape(-1, columns.shape[2]))

    def beside(self, extra: Array) -> Array:
        """What is left of columns when everything else may explain them, shape (k m + p, q)."""
        wide = np.vstack([extra, np.zeros((len(self.tied), extra.shape[1]))])
        return np.asarray(wide - self.basis @ (self.basis.T @ wide))

    def equations(self, extra: Array, out: int | None = None) -> tuple[Array, Array]:
        """As `LinearKind` says."""
        rows = slice(None) if out is None else np.repeat(self.fold_of != out, self.rows)
        A = self._wide(extra)[rows]
        return A.T @ A, A.T @ self.r[rows]

    def fall(self, extra: Array, step: Array) -> float:
        """As `LinearKind` says."""
        rows = self.r + self._wide(extra) @ step
        return float(self.r @ self.r - rows @ rows)

    def left_out(self, extra: Array, step: Array, fold: int) -> float:
        """As `LinearKind` says; contacts of the poses that were left out are where they fit best."""
        rows = (self.r + self._wide(extra) @ step).reshape(-1, self.rows)
        held = self.fold_of == fold
        for contact in set(self.contacts[held].tolist()) - {-1}:
            mine = self.contacts == contact
            W = self.whiten[mine][:, :3, :3]
            H, slope = np.einsum("mij,mik->jk", W, W), np.einsum("mij,mi->j", W, rows[mine][:, :3])
            rows[mine, :3] -= W @ np.linalg.solve(H, slope)
        return float(np.sum(rows[held] ** 2))

    def _wide(self, extra: Array) -> Array:
        return np.hstack([self.J, extra]) if extra.size else self.J


def prior_information(robot: Robot, names: Sequence[str]) -> Array:
    """Of the priors on some parameters, shape (p, p)."""
    return np.diag([robot.parameters[name].coordinate_sigma ** -2.0 for name in names])


def prior_pull(robot: Robot, names: Sequence[str]) -> Array:
    """Slope of the cost of the priors on some parameters at the robot's values, shape (p,)."""
    away = []
    for name in names:
        p = robot.parameters[name]
        distance = np.log(p.value / p.prior) if p.positive else p.value - p.prior
        away.append(distance / p.coordinate_sigma**2)
    return np.array(away)


def columns_of(result: PoseCalibration, hypothesis: ArmHypothesis) -> Array:
    """What the parameters of an effect that is not there would do to the rows of poses, shape (m, k, q).

    Of a stiffness its compliance counts, which is zero in a rigid joint.
    """
    found = []
    robot = at_null(result.robot, [hypothesis])
    for problem, calibration in zip(result.problems, result.calibrations, strict=True):
        other = replace(problem, robot=robot)
        added = {n: p.value for n, p in robot.parameters.items() if n not in result.robot.parameters}
        by_value = other.seen(problem.values(calibration) | added).by_value
        columns = np.stack([by_value[name] for name in hypothesis.names], axis=2)
        found.append(-columns * RIGID**2 if hypothesis.kind.soft else columns)
    return filled(found, 1)


def filled(pieces: Sequence[Array], axes: int) -> Array:
    """Arrays of some sessions one behind the other, their next axes made as long as the longest by zeros."""
    longest = [max(piece.shape[1 + k] for piece in pieces) for k in range(axes)]
    wide = []
    for piece in pieces:
        more = [(0, size - piece.shape[1 + k]) for k, size in enumerate(longest)]
        wide.append(np.pad(piece, [(0, 0), *more, *[(0, 0)] * (piece.ndim - 1 - axes)]))
    return np.concatenate(wide)


def _whitened(problem: PoseSet, calibration: Calibration) -> tuple[Array, Array, Array]:
    """Whitening of each pose, shape (m, k, k), residual, shape (m, k), and columns, shape (m, k, p)."""
    point = problem.point(calibration)
    W = np.linalg.inv(np.linalg.cholesky(problem.covariances(point)))
    r = (W @ problem.misses(point, calibration)[:, :, None])[:, :, 0]
    return W, r, W @ problem.columns(point, calibration)
