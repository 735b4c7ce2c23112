# SPDX-License-Identifier: BSD-3-Clause
"""How well the target is known anywhere the joints may go, not only near the poses that were fitted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.poses.calibrate_poses import PoseCalibration

Array = NDArray[np.float64]
DRAWN = 300  # postures
SHARE = 0.9  # of them that are known better than what is returned
HALF_TURN = np.pi  # [rad] where the URDF allows more, or sets no limit


def sigma_elsewhere(result: PoseCalibration) -> float:
    """Uncertainty of the target at postures all over the joints' limits [m].

    What all of them have in common, a turn and a shift of the base, does not count: contacts never tell it.

    Returns:
        Root of the trace of its covariance, which nine tenths of the postures do not exceed.
    """
    problem, calibration = result.problems[0], result.calibrations[0]
    arm = problem.arm
    limits = result.robot.tree.limits[arm.chain.places]
    limits = np.where(np.isfinite(limits), np.clip(limits, -HALF_TURN, HALF_TURN), [-HALF_TURN, HALF_TURN])
    q = np.random.default_rng(0).uniform(limits[:, 0], limits[:, 1], (DRAWN, len(limits)))
    point = arm.at(q, np.zeros_like(q), problem.values(calibration))
    J = np.zeros((DRAWN, 3, len(result.names)))
    for i, (name, scale) in enumerate(zip(calibration.names, calibration.value_by_coordinate, strict=True)):
        if name in point.by_value:
            J[:, :, i] = scale * point.by_value[name]
    turns = np.stack([np.cross(axis, point.target) for axis in np.eye(3)], axis=2)
    common = np.concatenate([np.broadcast_to(np.eye(3), turns.shape), turns], axis=2).reshape(3 * DRAWN, 6)
    flat = J.reshape(3 * DRAWN, -1)
    J = (flat - common @ np.linalg.lstsq(common, flat, rcond=None)[0]).reshape(J.shape)
    return float(np.quantile(np.sqrt(np.einsum("mki,ij,mkj->m", J, result.covariance, J)), SHARE))
