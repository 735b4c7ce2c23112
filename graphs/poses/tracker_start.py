# SPDX-License-Identifier: BSD-3-Clause
"""Where a tracker stands, from the poses themselves: the turn and shift that bring both clouds of targets together.

Least squares over rotations, by the singular values of the clouds' product (Arun, Huang, Blostein 1987).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.robots.geometry.error_parameters import LENGTHS, TOOL

Array = NDArray[np.float64]
ROUNDS = 200  # of place of the tracker and place of the target in turn


def base_from_tracker(in_base: Array, in_tracker: Array) -> tuple[Array, float, bool]:
    """Base from tracker, shape (4, 4), the root mean square of what is left [m], and whether a mirror fits better.

    Args:
        in_base: predicted targets, shape (m, 3) [m].
        in_tracker: measured ones.
    """
    a, b = in_base.mean(axis=0), in_tracker.mean(axis=0)
    U, _, Vt = np.linalg.svd((in_base - a).T @ (in_tracker - b))
    hand = float(np.sign(np.linalg.det(U @ Vt)))
    R, mirrored = U @ np.diag([1.0, 1.0, hand]) @ Vt, U @ Vt

    def left(turn: Array) -> float:
        return float(np.sqrt(np.mean(np.sum((in_base - a - (in_tracker - b) @ turn.T) ** 2, axis=1))))

    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, a - R @ b
    return T, left(R), hand < 0.0 and left(mirrored) < 0.1 * left(R)


def tracker_and_target(problem: PoseSet, in_tracker: Array) -> tuple[Array, Array, float]:
    """The same with the target anywhere on its link: both in turn.

    Returns:
        Base from tracker, shape (4, 4), shift of the target in the axes of its link, shape (3,), what is left [m].
    """
    values = problem.values(Calibration.of(problem.robot).only([DYNAMICS]))
    point = problem.arm.at(problem.q, np.zeros_like(problem.q), values)
    turns = np.stack([point.by_value[f"{TOOL}.{part}"] for part in LENGTHS], axis=2)
    shift, T, left = np.zeros(3), np.eye(4), np.inf
    for _ in range(ROUNDS):
        T, left, _ = base_from_tracker(point.target + turns @ shift, in_tracker)
        wanted = in_tracker @ T[:3, :3].T + T[:3, 3] - point.target
        spread, off = turns - turns.mean(axis=0), wanted - wanted.mean(axis=0)
        shift = np.linalg.lstsq(spread.reshape(-1, 3), off.reshape(-1), rcond=None)[0]
    return T, shift, left
