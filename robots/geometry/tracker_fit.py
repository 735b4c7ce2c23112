# SPDX-License-Identifier: BSD-3-Clause
"""Where a tracker stands, from the points it measured: the turn and shift that bring both clouds together.

Least squares over rotations, by the singular values of the clouds' product (Arun, Huang, Blostein 1987).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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


def tracker_and_shift(
    points: Array, turns: Array, in_tracker: Array, shift: Array, rounds: int = ROUNDS
) -> tuple[Array, Array, float]:
    """The same with the target anywhere on its link: both in turn.

    Args:
        points: where it is predicted without a shift, shape (m, 3) [m].
        turns: rotations of its link, shape (m, 3, 3).
        in_tracker: measured ones, shape (m, 3) [m].
        shift: of the target in the axes of its link to begin with, shape (3,) [m].
        rounds: of place of the tracker and place of the target in turn.

    Returns:
        Base from tracker, shape (4, 4), shift of the target in the axes of its link, shape (3,), what is left [m].
    """
    T, left = np.eye(4), np.inf
    spread = (turns - turns.mean(axis=0)).reshape(-1, 3)
    for _ in range(rounds):
        T, left, _ = base_from_tracker(points + turns @ shift, in_tracker)
        wanted = in_tracker @ T[:3, :3].T + T[:3, 3] - points
        shift = np.linalg.lstsq(spread, (wanted - wanted.mean(axis=0)).reshape(-1), rcond=None)[0]
    return T, shift, left
