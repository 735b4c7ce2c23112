# SPDX-License-Identifier: BSD-3-Clause
"""Where a tracker stands, from the poses themselves, while the target is anywhere on its link."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.robots.bodies.misplaced_joints import LENGTHS
from jointscope.robots.geometry.error_parameters import TOOL
from jointscope.robots.geometry.tracker_fit import tracker_and_shift

Array = NDArray[np.float64]


def tracker_and_target(problem: PoseSet, in_tracker: Array) -> tuple[Array, Array, float]:
    """Tracker and target of a set of poses.

    Returns:
        Base from tracker, shape (4, 4), shift of the target in the axes of its link, shape (3,), what is left [m].
    """
    values = problem.values(Calibration.of(problem.robot).only([DYNAMICS]))
    point = problem.arm.at(problem.q, np.zeros_like(problem.q), values)
    turns = np.stack([point.by_value[f"{TOOL}.{part}"] for part in LENGTHS], axis=2)
    return tracker_and_shift(point.target, turns, in_tracker, np.zeros(3))
