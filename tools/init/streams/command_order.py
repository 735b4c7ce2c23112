# SPDX-License-Identifier: BSD-3-Clause
"""Whose command is which column, where the messages name no joints: the one that the joint's motion asks for.

A joint's command follows its load, speed and direction of motion. Columns stay in the order of the URDF unless another
order explains them clearly better; controllers have their own order, which no bag tells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.joint_motion import joint_motion
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

EXPLAINED = 0.7  # share of a column that the joint it is given to must explain
CLEARLY = 0.3  # share that it must explain more than the joint whose place it is


def order_by_motion(
    tree: RigidTree, masses: bool, encoder: Stream, times: Array, columns: Array, places: tuple[int, ...]
) -> tuple[int, ...]:
    """Columns of the joints: `places`, or those that the motion asks for.

    Args:
        tree: the robot.
        masses: whether its masses are known.
        encoder: positions of the joints [rad].
        times: of the commands, shape (m,) [s].
        columns: all commands, shape (m, k).
        places: of the joints in the order of the URDF.
    """
    motion = joint_motion(encoder, np.zeros(tree.n))
    a = np.gradient(motion.v, motion.times, axis=0)
    load = tree.torque(motion.q, motion.v, a) if masses else a
    held = columns[np.clip(np.searchsorted(times, motion.times, side="right") - 1, 0, len(times) - 1)]
    known = np.isfinite(held).all(axis=1)
    share = np.array(
        [
            [_explained(held[known, c], load[known, j], motion.v[known, j]) for c in range(held.shape[1])]
            for j in range(tree.n)
        ]
    )
    best = tuple(int(c) for c in linear_sum_assignment(-share)[1])
    moved = [j for j in range(tree.n) if best[j] != places[j]]
    clear = all(share[j, best[j]] > EXPLAINED and share[j, best[j]] > share[j, places[j]] + CLEARLY for j in moved)
    return best if moved and clear else places


def _explained(u: Array, load: Array, v: Array) -> float:
    """Share of a command's variance that the motion of a joint explains."""
    if not np.ptp(u):
        return 0.0
    X = np.column_stack([load, v, np.sign(v), np.ones(len(v))])
    X = X / np.linalg.norm(X, axis=0).clip(1e-300)
    rest = u - X @ np.linalg.lstsq(X, u, rcond=None)[0]
    return float(1.0 - np.mean(rest**2) / np.var(u))
