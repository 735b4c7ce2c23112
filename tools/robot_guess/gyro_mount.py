# SPDX-License-Identifier: BSD-3-Clause
"""Which link carries a gyroscope, and how it is mounted: the one whose motion by the encoders it sees.

For every link the rotation that turns its rate into the measured one best (Wahba's problem, solved by an SVD as in
Markley 1988) is found; the link that leaves least is chosen. Mountings in right angles come first: many motions turn a
link about one axis only and say nothing about the rotation around it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.joint_motion import JointMotion, window_mean
from jointscope.robots.recording import Stream
from jointscope.robots.rigid_tree import RigidTree
from jointscope.robots.units import si_factor

Array = NDArray[np.float64]

STANDS_STILL = 0.02  # [rad/s] rms; a gyroscope that turns less sits on the base, or nothing moved it
CLEARLY = 0.03  # share of the power by which a mounting out of square must be better
ALIKE = 0.02  # share of the power that decides between two links
FITS = 0.5  # share of the power left, above which no link explains a gyroscope
DEGREES = (20.0, 150.0)  # ratio of the rates at which the gyroscope must be in deg/s
HALF, WORTH_TURNING = 0.5, 0.1  # turned joints must leave less than this part, and that much less of the power
ONE_AXIS = 1e-3  # share of the power about the other axes that shows a rotation


@dataclass(frozen=True)
class Mount:
    """A gyroscope on a link.

    Attributes:
        body: link of the URDF.
        R_imu_body: from body to sensor coordinates, shape (3, 3).
        left: share of the gyroscope's power that remains, 0 to 1.
        unit: of its values, "rad/s" or "deg/s".
        square: whether it is mounted in right angles.
        open_axis: the link turned about one axis only: the rotation about it is not known.
        others: links that explain it as well.
    """

    body: str
    R_imu_body: Array
    left: float
    unit: str
    square: bool
    open_axis: bool
    others: tuple[str, ...]


def find_mount(tree: RigidTree, motion: JointMotion, gyro: Stream) -> Mount | None:
    """The link that a gyroscope sits on; None where it stands still or no link explains it.

    Args:
        tree: the robot.
        motion: of its joints.
        gyro: samples as they stand in the bag.
    """
    inside = (motion.times > gyro.times[0]) & (motion.times < gyro.times[-1])
    if np.count_nonzero(inside) < 10:
        return None
    measured = window_mean(gyro, motion.times[inside], motion.window)
    measured = measured - measured.mean(axis=0)
    power = float(np.mean(np.sum(measured**2, axis=1)))
    found = []
    for body in _one_body_per_joint(tree):
        rate = tree.body_rate(body, motion.q[inside], motion.v[inside])[0]
        rate = rate - rate.mean(axis=0)
        size = float(np.mean(np.sum(rate**2, axis=1)))
        if size < STANDS_STILL**2:
            continue
        ratio = float(np.sqrt(power / size))
        unit = "deg/s" if DEGREES[0] < ratio < DEGREES[1] else "rad/s"
        scaled = measured * si_factor(unit)
        if np.mean(np.sum(scaled**2, axis=1)) < STANDS_STILL**2:
            continue
        found.append(_mounted(body, scaled, rate, unit))
    found.sort(key=lambda mount: mount.left)
    if not found or found[0].left > FITS:
        return None
    best = found[0]
    others = tuple(m.body for m in found[1:] if m.left < best.left + ALIKE)
    return replace(best, others=others)


@dataclass(frozen=True)
class SignGuess:
    """Which way the encoders count.

    Attributes:
        signs: of the joints, 1 where nothing speaks against it, shape (n,).
        others: other signs with which the gyroscopes agree as well, with as few turned joints.
    """

    signs: tuple[float, ...]
    others: tuple[tuple[float, ...], ...] = ()


def joint_signs(tree: RigidTree, motion: JointMotion, gyros: list[Stream]) -> SignGuess:
    """Signs of the joints that let the gyroscopes agree with the encoders, fewest turned joints first."""
    n = motion.q.shape[1]
    patterns = sorted(product((1.0, -1.0), repeat=n), key=lambda signs: -sum(signs))
    left = {signs: _left_of_all(tree, motion, gyros, np.array(signs)) for signs in patterns}
    as_is, least = left[patterns[0]], min(left.values())
    if least > HALF * as_is or as_is - least < WORTH_TURNING:
        return SignGuess(patterns[0])
    best = [signs for signs in patterns if left[signs] < least + ALIKE]
    return SignGuess(best[0], tuple(signs for signs in best[1:] if sum(signs) == sum(best[0])))


def _left_of_all(tree: RigidTree, motion: JointMotion, gyros: list[Stream], signs: Array) -> float:
    turned = JointMotion(motion.times, motion.window, motion.q * signs, motion.v * signs)
    mounts = [find_mount(tree, turned, gyro) for gyro in gyros]
    return float(np.mean([1.0 if mount is None else mount.left for mount in mounts])) if mounts else 0.0


def _one_body_per_joint(tree: RigidTree) -> list[str]:
    """The first link behind every joint; further ones on the same joint turn alike."""
    seen: dict[tuple[int, ...], str] = {}
    for body in tree.bodies:
        joints = tree.joints_below(body)
        if joints:
            seen.setdefault(joints, body)
    return list(seen.values())


def _mounted(body: str, measured: Array, rate: Array, unit: str) -> Mount:
    power = np.sum(measured**2)
    axes = np.linalg.svd(rate, compute_uv=False) ** 2
    open_axis = bool(axes[1] < ONE_AXIS * axes[0])
    square = min(_right_angles(), key=lambda R: float(np.sum((measured - rate @ R.T) ** 2)))
    left_square = float(np.sum((measured - rate @ square.T) ** 2) / power)
    free = _wahba(measured, rate)
    left_free = float(np.sum((measured - rate @ free.T) ** 2) / power)
    if left_free < left_square - CLEARLY:
        return Mount(body, free, left_free, unit, False, open_axis, ())
    return Mount(body, square, left_square, unit, True, open_axis, ())


def _wahba(measured: Array, rate: Array) -> Array:
    """The rotation R with measured = R rate, least squares, shape (3, 3)."""
    U, _, Vt = np.linalg.svd(measured.T @ rate)
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt, dtype=np.float64)


@cache
def _right_angles() -> tuple[Array, ...]:
    """The 24 rotations by right angles, the identity first."""
    found = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            R = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(R) > 0:
                found.append(R)
    return tuple(found)
