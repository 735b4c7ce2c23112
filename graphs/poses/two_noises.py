# SPDX-License-Identifier: BSD-3-Clause
"""How large two noises are that add up in every pose: what transmissions do unseen, and that of measured orientations.

    C = s^2 J S J' + t^2 I_turns + noise of places,    s^2 <- s^2 (r' C^-1 V C^-1 r) / trace(V P),    V = dC / ds^2
    P = C^-1 - C^-1 A K A' C^-1

The fixed point is the restricted likelihood's maximum (Harville, J. Am. Stat. Assoc. 72, 1977): the share of C^-1 that
the fit has used up, by its columns A and their covariance K, does not count.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.pose_set import PoseSet

Array = NDArray[np.float64]
SMALLEST = 1e-2  # of a step


def noise_ratios(
    problems: Sequence[PoseSet], calibrations: Sequence[Calibration], covariances: Sequence[Array]
) -> tuple[float, float]:
    """Squared factors on the repeatability and on the noise of orientations; 1 is right.

    Args:
        problems: the sessions.
        calibrations: of each.
        covariances: of all coordinates of each of these.
    """
    squares, shares = np.zeros(2), np.zeros(2)
    for problem, calibration, covariance in zip(problems, calibrations, covariances, strict=True):
        point = problem.point(calibration)
        weights = np.linalg.inv(problem.covariances(point))
        A = problem.columns(point, calibration)
        used = weights @ A
        P = weights - used @ covariance @ np.swapaxes(used, 1, 2)
        pull = np.einsum("mij,mj->mi", weights, problem.misses(point, calibration))
        turns = problem.targets.there & problem.targets.turns
        for k, V in enumerate((point.by_joint * problem.sigmas, turns[:, :, None] * np.eye(turns.shape[1]))):
            squares[k] += float(np.sum(np.einsum("mij,mi->mj", V, pull) ** 2))
            shares[k] += float(np.einsum("mij,mik,mkj->", V, P, V))
    found = np.where(shares > 0.0, squares / np.maximum(shares, 1e-300), 1.0)
    return float(max(found[0], SMALLEST)), float(max(found[1], SMALLEST))
