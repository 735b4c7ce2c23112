# SPDX-License-Identifier: BSD-3-Clause
"""Positions from before a gear: how far the links really turn, by the gyroscopes.

omega_imu = R sum_j s_j J_j(s q) v_j is linear in the scales s where R and the posture are known, and R follows from
Wahba's problem where they are; the two take turns, from the scale that all joints would share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.tools.init.estimates.gyro_mount import SeenRate, all_mounts, likely_seats

Array = NDArray[np.float64]

MOST_JOINTS = 12
ROUNDS = 30
SETTLED = 1e-6  # relative change of the scales
EXPLAINED = 0.05  # share of the power that may remain, or the scales are not believed
WHOLE = 1e-3  # relative; a ratio so near to a whole number is one


def gear_scales(tree: RigidTree, gyros: Sequence[SeenRate]) -> Array | None:
    """Sizes of the factors on the positions of the joints that let the gyroscopes agree; None where they do not tell.

    Which joints count backwards is left open: mirrored robots turn their gyroscopes alike.

    Args:
        tree: the robot.
        gyros: what they and the encoders saw, positions as they stand.
    """
    if tree.n > MOST_JOINTS or tree.slides or not gyros:
        return None
    found: list[tuple[float, Array]] = []
    for seen in gyros:
        for body in likely_seats(tree, _shrunk(seen, _shared(tree, seen)), tree.n):
            if len(tree.joints_below(body)) == tree.n:
                found.append(_from(tree, seen, body))
    left, scales = min(found, key=lambda entry: entry[0], default=(1.0, np.ones(tree.n)))
    if left > EXPLAINED or not np.all(scales):
        return None
    ratios = 1.0 / np.abs(scales)
    whole = np.rint(ratios)
    return np.asarray(1.0 / np.where((whole > 1.0) & (np.abs(ratios / whole.clip(1.0) - 1.0) < WHOLE), whole, ratios))


def _shared(tree: RigidTree, seen: SeenRate) -> float:
    """The scale with which the fastest body turns as fast as the gyroscope, at the posture of the middle."""
    still = replace(seen, q=np.zeros_like(seen.q))
    sizes = [float(np.mean(np.sum(rate**2, axis=1))) for rate in tree.joint_rates(still.q, still.v).values()]
    return float(np.sqrt(seen.power / max(sizes)))


def _shrunk(seen: SeenRate, scales: float | Array) -> SeenRate:
    return replace(seen, q=seen.q * scales, v=seen.v * scales)


def _from(tree: RigidTree, seen: SeenRate, body: str) -> tuple[float, Array]:
    """Share of the power that remains, and the scales, if a gyroscope sits on a link."""
    scales = np.full(tree.n, _shared(tree, seen))
    for _ in range(ROUNDS):
        mounts = all_mounts(tree, _shrunk(seen, scales), mirrored=False, seats=(body,))
        if not mounts:
            return 1.0, scales
        mount = mounts[0]
        measured = seen.measured
        J = tree.body_rate(body, seen.q * scales, seen.v)[2]
        columns = np.einsum("ij,mjn->min", mount.R_imu_body, J) * seen.v[:, None, :]
        columns = columns - columns.mean(axis=0)
        new = np.linalg.lstsq(columns.reshape(-1, tree.n), measured.ravel(), rcond=None)[0]
        done = np.allclose(new, scales, rtol=SETTLED)
        scales = new
        if done:
            break
    rest = measured.ravel() - columns.reshape(-1, tree.n) @ scales
    return float(np.mean(rest**2) / np.mean(measured**2)), scales
