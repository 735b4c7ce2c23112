# SPDX-License-Identifier: BSD-3-Clause
"""How far apart contacts are if nobody says it: what `contact_distance` is checked by.

The lengths of an arm are known from its URDF to a share of a percent, and with them every distance in its workspace. A
known distance is better, and wins; a wrong one stretches the arm, and no residual shows it.

Without a known distance the sum of squares prefers small arms, which miss by less. What was measured are angles q, not
misses r, and their density has the volume factor between the two:

    -log p(q) = r' C^-1 r / 2 + log det C / 2 - log det(J S J') / 2,    C = J S J' + noise of the target
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.poses.linear_poses import LinearPoses
from jointscope.graphs.poses.pose_set import PoseSet

Array = NDArray[np.float64]
SPACE = 3  # joints that fewest move a target in all directions; the density above is one of such arms
STEP = 0.05  # [sigma of the distance] of the difference that is taken for a slope


@dataclass(frozen=True)
class UntoldDistance:
    """Mean distance of the two contacts of each place as the arm has it, without being told.

    Attributes:
        said: in the robot file [m].
        found: by poses and priors [m].
        sigma: of `found` less `said` [m].
    """

    said: float
    found: float
    sigma: float

    @property
    def distance(self) -> float:
        """How far off what is said is [sigma]."""
        return abs(self.found - self.said) / self.sigma


def untold_distance(result: PoseCalibration) -> UntoldDistance | None:
    """Takes what is said of distances out of the linearised estimate; None where nothing is said."""
    setup = result.robot.poses
    if setup is None or setup.contact_distance is None or not any(problem.pairs for problem in result.problems):
        return None
    if result.problems[0].q.shape[1] < SPACE:
        return None
    linear = LinearPoses.of(result)
    information = linear.J.T @ linear.J + linear.tied - linear.apart.T @ linear.apart
    mean = linear.apart.mean(axis=0)
    along = np.linalg.solve(information, mean)
    variance = float(mean @ along)
    step = STEP / np.sqrt(variance) * along
    slope = float((linear.pull - linear.apart.T @ linear.off) @ along)
    for problem, calibration, place in zip(result.problems, result.calibrations, linear.places, strict=True):
        ends = [_unlikely(problem, _moved(calibration, sign * step[place])) for sign in (1.0, -1.0)]
        slope += (ends[0] - ends[1]) / (2.0 * STEP) * np.sqrt(variance)
    said, noise = setup.contact_distance, 1.0 / len(linear.off)
    found = said + setup.target_sigma * float(linear.off.mean() - slope)
    return UntoldDistance(said, found, setup.target_sigma * float(np.sqrt(variance + noise)))


def _moved(calibration: Calibration, step: Array) -> Calibration:
    return calibration.retract({name: step[index] for name, index in calibration.columns.items()})


def _unlikely(problem: PoseSet, calibration: Calibration) -> float:
    """Minus the logarithm of the density of the angles, but for a constant."""
    assert problem.robot.poses is not None
    point = problem.point(calibration)
    r, C = problem.misses(point, calibration), problem.covariances(point)
    squares = float(np.einsum("mk,mk->", r, np.linalg.solve(C, r[:, :, None])[:, :, 0]))
    by_joints = C - problem.robot.poses.target_sigma**2 * np.eye(3)
    return 0.5 * (squares + float(np.sum(np.linalg.slogdet(C)[1] - np.linalg.slogdet(by_joints)[1])))
