# SPDX-License-Identifier: BSD-3-Clause
"""Poses linearised at a calibrated arm, whitened: what every value, and every effect that is not there, would do.

Errors of an arm are so small that a linear step is the answer to micrometres. Fits of a model with one more effect, on
some poses or on all, are then small systems of equations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.robots.geometry.pose_effects import PoseHypothesis
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter

Array = NDArray[np.float64]
RIGID = 1e12  # [N m/rad] start of a stiffness whose compliance is looked for


@dataclass(frozen=True)
class LinearPoses:
    """Whitened rows of all poses: residual r + J d of a step d away from the calibrated values.

    Attributes:
        r: shape (3 m,) [sigma].
        J: columns of the values and of the points of contacts, shape (3 m, p).
        prior: inverse of each column's prior sigma, zero where there is none, shape (p,).
        groups: number of the group of each pose, shape (m,).
        whiten: of each pose, shape (m, 3, 3).
    """

    r: Array
    J: Array
    prior: Array
    groups: NDArray[np.intp]
    whiten: Array

    @staticmethod
    def of(result: PoseCalibration) -> LinearPoses:
        """The poses of a calibration at its values."""
        pieces, contacts = [], 0
        size = len(result.names)
        total = size + 3 * sum(len(problem.contacts) for problem in result.problems)
        for problem, calibration in zip(result.problems, result.calibrations, strict=True):
            W, r, J = _whitened(problem, calibration)
            wide = np.zeros((len(r), total))
            index = calibration.columns[DYNAMICS]
            wide[:, :size] = J[:, index]
            own = [k for k in range(calibration.size) if not index.start <= k < index.stop]
            wide[:, size + contacts : size + contacts + len(own)] = J[:, own]
            contacts += len(own)
            pieces.append((r, wide, W, problem.poses.groups))
        names = [group for *_, groups in pieces for group in groups]
        number = {name: i for i, name in enumerate(dict.fromkeys(names))}
        prior = np.zeros(total)
        prior[:size] = [1.0 / result.robot.parameters[name].coordinate_sigma for name in result.names]
        return LinearPoses(
            np.concatenate([r for r, *_ in pieces]),
            np.concatenate([J for _, J, *_ in pieces]),
            prior,
            np.array([number[name] for name in names]),
            np.concatenate([W for _, _, W, _ in pieces]),
        )

    def whitened(self, columns: Array) -> Array:
        """Columns of shape (m, 3, k) as rows, shape (3 m, k)."""
        return np.asarray((self.whiten @ columns).reshape(-1, columns.shape[2]))

    def fitted(self, extra: Array, sigmas: Array, kept: NDArray[np.bool_] | None = None) -> tuple[Array, Array]:
        """Step of all columns and of extra ones on some poses, shape (p + k,), and its covariance."""
        rows = slice(None) if kept is None else np.repeat(kept, 3)
        A = np.hstack([self.J, extra])[rows]
        inverse = np.concatenate([self.prior, 1.0 / sigmas])
        H = A.T @ A + np.diag(inverse**2) + 1e-12 * np.diag(np.sum(A**2, axis=0))
        covariance = np.asarray(np.linalg.inv(H), dtype=np.float64)
        return -covariance @ (A.T @ self.r[rows]), covariance

    def left(self, extra: Array, step: Array) -> Array:
        """Squared distances of the poses after a step [sigma^2], shape (m,)."""
        rows = self.r + np.hstack([self.J, extra]) @ step
        return np.asarray(np.sum(rows.reshape(-1, 3) ** 2, axis=1))


def columns_of(result: PoseCalibration, hypothesis: PoseHypothesis) -> Array:
    """What the parameters of an effect that is not there would do to the targets, shape (m, 3, k).

    Of a stiffness its compliance counts, which is zero in a rigid joint.
    """
    found = []
    robot = with_effect(
        result.robot, hypothesis, dict.fromkeys(hypothesis.names, RIGID if hypothesis.kind.soft else 0.0)
    )
    for problem, calibration in zip(result.problems, result.calibrations, strict=True):
        other = replace(problem, robot=robot)
        e = np.zeros((len(problem.poses), len(problem.arm.chain.joints)))
        values = other.values(calibration) | {name: robot.parameters[name].value for name in hypothesis.names}
        point = other.seen(e, values)
        columns = np.stack([point.by_value[name] for name in hypothesis.names], axis=2)
        found.append(-columns * RIGID**2 if hypothesis.kind.soft else columns)
    return np.concatenate(found)


def with_effect(robot: Robot, hypothesis: PoseHypothesis, values: dict[str, float]) -> Robot:
    """The robot with an effect whose sizes begin at some values."""
    kind, parameters = hypothesis.kind, dict(robot.parameters)
    for name in hypothesis.names:
        value = values[name]
        prior, sigma = (value, 1.1 * value) if kind.soft else (0.0, kind.size)
        parameters[name] = Parameter(name, value, kind.unit, prior, sigma, positive=kind.soft, effect=kind.id)
    return replace(robot, parameters=parameters)


def _whitened(problem: PoseSet, calibration: Calibration) -> tuple[Array, Array, Array]:
    """Whitening of each pose, shape (m, 3, 3), residual, shape (3 m,), and columns, shape (3 m, p)."""
    assert problem.robot.poses is not None
    e = np.zeros((len(problem.poses), len(problem.arm.chain.joints)))
    point = problem.point(e, calibration)
    J = point.by_joint * problem.sigmas
    V = J @ np.swapaxes(J, 1, 2) + problem.robot.poses.target_sigma**2 * np.eye(3)
    W = np.linalg.inv(np.linalg.cholesky(V))
    r = (W @ problem.misses(point, calibration)[:, :, None])[:, :, 0]
    columns = W @ problem.columns(point, calibration)
    return W, r.reshape(-1), columns.reshape(-1, calibration.size)
