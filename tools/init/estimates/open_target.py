# SPDX-License-Identifier: BSD-3-Clause
"""What a motion does not tell of a target and its tracker: a target on the first link turns about one axis alone.

The tracker measures p = R (p_base + R_link (at + offset) - place), with R of the tracker times a small turn. What moves
nothing that is measured, as the target along the axis together with the tracker, is held where it was fitted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.parts.position_target import PositionTarget

Array = NDArray[np.float64]

DETERMINED = 0.5  # [prior sigma] a direction known worse than this is a guess
MOST_POINTS = 300


def held_parameters(tree: RigidTree, target: PositionTarget, q: Array, sigma: float, priors: Array) -> tuple[str, ...]:
    """Names of the parameters to hold, so that a recording determines all others.

    Args:
        tree: in the posture of the recording.
        target: with the place of its tracker.
        q: angles where the tracker measured, shape (m, n) [rad].
        sigma: of the noise of one component [m].
        priors: standard deviation of each parameter, shape (9,) [m], [rad].
    """
    q = q[:: max(len(q) // MOST_POINTS, 1)]
    R_link, p_link = tree.body_poses(target.body, q)
    R_tracker, origin = target.tracker_pose[:3, :3], target.tracker_pose[:3, 3]
    seen = (p_link + R_link @ target.at - origin) @ R_tracker
    by_offset = R_tracker.T @ R_link
    by_place = np.broadcast_to(-R_tracker.T, by_offset.shape)
    by_turn = np.cross(seen[:, None, :], np.eye(3)).transpose(0, 2, 1)
    J = np.concatenate([by_offset, by_place, by_turn], axis=2).reshape(-1, 9) * priors / sigma
    information, names, held = J.T @ J, [*target.offset, *target.place, *target.turn], list[int]()
    while len(held) < len(names):
        free = [i for i in range(len(names)) if i not in held]
        values, vectors = np.linalg.eigh(information[np.ix_(free, free)])
        if (1.0 + values[0]) * DETERMINED**2 > 1.0:
            break
        held.append(free[int(np.argmax(np.abs(vectors[:, 0])))])
    return tuple(names[i] for i in sorted(held))
