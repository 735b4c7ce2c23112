# SPDX-License-Identifier: BSD-3-Clause
"""Poses linearised at a calibrated arm, whitened: what every value, and every effect that is not there, would do.

Errors of an arm are so small that a linear step is the answer to micrometres. Fits of a model with one more effect, on
some poses or on all, are then small systems of equations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.robots.geometry.error_parameters import RIPPLE
from jointscope.robots.geometry.arm_effects import ArmHypothesis
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter

Array = NDArray[np.float64]
SPREAD = 1.0  # [m] prior sigma of the point of a contact, so that one that was left out has one
ORDER_SIGMA = 0.3  # of the waves per turn, about the best whole number
RIGID = 1e12  # [N m/rad] start of a stiffness whose compliance is looked for


@dataclass(frozen=True)
class LinearPoses:
    """Whitened rows of all poses: residual r + J d of a step d away from the calibrated values.

    Attributes:
        r: shape (3 m,) [sigma].
        J: columns of the values and of the points of contacts, shape (3 m, p).
        tied: information on the columns from priors and known distances, shape (p, p).
        pull: slope of the cost of these at the calibrated values, which that of the poses balances, shape (p,).
        groups: number of the group of each pose, shape (m,).
        contacts: number of the contact of each pose, shape (m,); -1 where a tracker measured.
        whiten: of each pose, shape (m, 3, 3).
    """

    r: Array
    J: Array
    tied: Array
    pull: Array
    groups: NDArray[np.intp]
    contacts: NDArray[np.intp]
    whiten: Array

    @staticmethod
    def of(result: PoseCalibration) -> LinearPoses:
        """The poses of a calibration at its values."""
        pieces, names, held, size = [], list[str](), list[int](), len(result.names)
        total = size + 3 * sum(len(problem.contacts) for problem in result.problems)
        tied = np.diag(np.full(total, SPREAD**-2.0))
        sigmas = np.array([result.robot.parameters[name].coordinate_sigma for name in result.names])
        tied[:size, :size] = np.diag(sigmas**-2)
        first = size
        for problem, calibration in zip(result.problems, result.calibrations, strict=True):
            index = calibration.columns[DYNAMICS]
            own = [k for k in range(calibration.size) if not index.start <= k < index.stop]
            place = np.zeros(calibration.size, dtype=np.intp)
            place[index], place[own] = np.arange(size), np.arange(first, first + len(own))
            W, r, J = _whitened(problem, calibration)
            wide = np.zeros((len(r), total))
            wide[:, place] = J
            apart = problem.distances(calibration)[1]
            tied[np.ix_(place, place)] += apart.T @ apart
            number = {contact: (first - size) // 3 + i for i, contact in enumerate(problem.contacts)}
            held += [number[c] for c in problem.poses.contacts] or [-1] * len(problem.poses)
            names += problem.poses.groups
            first += len(own)
            pieces.append((r, wide, W))
        groups = {name: i for i, name in enumerate(dict.fromkeys(names))}
        r, J, W = (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
        numbers = np.array([groups[name] for name in names])
        return LinearPoses(r, J, tied, -J.T @ r, numbers, np.array(held), W)

    @cached_property
    def basis(self) -> Array:
        """Orthonormal basis of all that the columns and what ties them explain, shape (3 m + p, p)."""
        return np.asarray(np.linalg.qr(np.vstack([self.J, np.linalg.cholesky(self.tied).T]))[0])

    def whitened(self, columns: Array) -> Array:
        """Columns of shape (m, 3, k) as rows, shape (3 m, k)."""
        return np.asarray((self.whiten @ columns).reshape(-1, columns.shape[2]))

    def beside(self, extra: Array) -> Array:
        """What is left of columns when everything else may explain them, shape (3 m + p, k)."""
        wide = np.vstack([extra, np.zeros((len(self.pull), extra.shape[1]))])
        return np.asarray(wide - self.basis @ (self.basis.T @ wide))

    def fitted(self, extra: Array, sigmas: Array, kept: NDArray[np.bool_] | None = None) -> tuple[Array, Array]:
        """Step of all columns and of extra ones on some poses, shape (p + k,), and its covariance."""
        rows = slice(None) if kept is None else np.repeat(kept, 3)
        A, p = np.hstack([self.J, extra])[rows], len(self.pull)
        H, slope = A.T @ A, A.T @ self.r[rows]
        H[:p, :p] += self.tied
        H[p:, p:] += np.diag(sigmas**-2.0)
        slope[:p] += self.pull
        covariance = np.asarray(np.linalg.inv(H), dtype=np.float64)
        return -covariance @ slope, covariance

    def left(self, extra: Array, step: Array) -> Array:
        """Squared distances of the poses after a step [sigma^2], shape (m,)."""
        rows = self.r + np.hstack([self.J, extra]) @ step
        return np.asarray(np.sum(rows.reshape(-1, 3) ** 2, axis=1))

    def left_out(self, extra: Array, step: Array, held: NDArray[np.bool_]) -> float:
        """Sum of squared distances of poses that a step was not fitted to; their contacts are where they fit best."""
        rows = (self.r + np.hstack([self.J, extra]) @ step).reshape(-1, 3)
        for contact in set(self.contacts[held].tolist()) - {-1}:
            mine = self.contacts == contact
            W = self.whiten[mine]
            H, slope = np.einsum("mij,mik->jk", W, W), np.einsum("mij,mi->j", W, rows[mine])
            rows[mine] -= W @ np.linalg.solve(H, slope)
        return float(np.sum(rows[held] ** 2))


def columns_of(result: PoseCalibration, hypothesis: ArmHypothesis) -> Array:
    """What the parameters of an effect that is not there would do to the targets, shape (m, 3, k).

    Of a stiffness its compliance counts, which is zero in a rigid joint.
    """
    found = []
    robot = with_effect(
        result.robot, hypothesis, dict.fromkeys(hypothesis.names, RIGID if hypothesis.kind.soft else 0.0)
    )
    for problem, calibration in zip(result.problems, result.calibrations, strict=True):
        other = replace(problem, robot=robot)
        added = {n: p.value for n, p in robot.parameters.items() if n not in result.robot.parameters}
        by_value = other.seen(problem.values(calibration) | added).by_value
        columns = np.stack([by_value[name] for name in hypothesis.names], axis=2)
        found.append(-columns * RIGID**2 if hypothesis.kind.soft else columns)
    return np.concatenate(found)


def with_effect(robot: Robot, hypothesis: ArmHypothesis, values: dict[str, float]) -> Robot:
    """The robot with an effect whose sizes begin at some values."""
    kind, parameters = hypothesis.kind, dict(robot.parameters)
    for name in hypothesis.names:
        value = values[name]
        prior, sigma = (value, 1.1 * value) if kind.soft else (0.0, kind.size)
        parameters[name] = Parameter(name, value, kind.unit, prior, sigma, positive=kind.soft, effect=kind.id)
    if kind.orders:
        name, order = f"{hypothesis.owner}.{RIPPLE[2]}", float(hypothesis.order or kind.orders[0])
        parameters[name] = Parameter(name, order, "1", order, ORDER_SIGMA, positive=False, effect=kind.id)
    return replace(robot, parameters=parameters)


def _whitened(problem: PoseSet, calibration: Calibration) -> tuple[Array, Array, Array]:
    """Whitening of each pose, shape (m, 3, 3), residual, shape (3 m,), and columns, shape (3 m, p)."""
    point = problem.point(calibration)
    W = np.linalg.inv(np.linalg.cholesky(problem.covariances(point)))
    r = (W @ problem.misses(point, calibration)[:, :, None])[:, :, 0]
    columns = W @ problem.columns(point, calibration)
    return W, r.reshape(-1), columns.reshape(-1, calibration.size)
