# SPDX-License-Identifier: BSD-3-Clause
"""How many waves per turn a gear would have: the number whose two amplitudes explain most of what is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.linear_poses import LinearPoses, filled
from jointscope.robots.geometry.arm_effects import ArmHypothesis

Array = NDArray[np.float64]


def with_best_order(linear: LinearPoses, result: PoseCalibration, hypothesis: ArmHypothesis) -> ArmHypothesis:
    """The effect with the best of its orders; one without orders as it is."""
    if not hypothesis.kind.orders:
        return hypothesis
    j = result.problems[0].arm.chain.joints.index(hypothesis.owner)
    q = np.concatenate([problem.q[:, j] for problem in result.problems])
    pairs = zip(result.problems, result.calibrations, strict=True)
    turn = filled([problem.point(calibration).by_joint[:, :, j] for problem, calibration in pairs], 1)
    angles = np.outer(q, hypothesis.kind.orders)
    scores = _scores(linear, hypothesis.kind.size, *(turn[:, :, None] * f(angles)[:, None] for f in (np.cos, np.sin)))
    return replace(hypothesis, order=hypothesis.kind.orders[int(np.argmax(scores))])


def _scores(linear: LinearPoses, sigma: float, cos: Array, sin: Array) -> Array:
    """Fall of chi2 by each pair of columns of shape (m, k, q), all else fitted anew, shape (q,)."""
    columns = [linear.whitened(each) for each in (cos, sin)]
    g = np.stack([each.T @ linear.r for each in columns], axis=1)  # all else is at its best, so that it takes no part
    own = [linear.beside(each) for each in columns]
    H = np.array([[np.sum(a * b, axis=0) for a in own] for b in own])
    H = np.moveaxis(H, 2, 0) + np.eye(2) / sigma**2
    return np.asarray(np.einsum("ki,ki->k", g, np.linalg.solve(H, g[:, :, None])[:, :, 0]))
