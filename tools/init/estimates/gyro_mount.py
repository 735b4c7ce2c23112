# SPDX-License-Identifier: BSD-3-Clause
"""Which link carries a gyroscope, and how it is mounted: the one whose motion by the encoders it sees.

For every link the rotation that turns its rate into the measured one best (Wahba's problem, solved by an SVD as in
Markley 1988) is found; the link that leaves least is chosen. Mountings in right angles come first: many motions turn a
link about one axis only and say nothing about the rotation around it. All that is needed of two rates is the sum of
their products C = sum omega_imu omega_body^T:

    sum |omega_imu - R omega_body|^2 = sum |omega_imu|^2 + sum |omega_body|^2 - 2 tr(R^T C)

A gyroscope whose frame is left-handed is one that a reflection explains and no rotation does; its x axis is turned.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cache
from itertools import permutations, product

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.joint_motion import JointMotion, window_mean
from jointscope.robots.recordings.recording import Stream
from jointscope.robots.units import si_factor

Array = NDArray[np.float64]

STANDS_STILL = 0.02  # [rad/s] rms; a gyroscope that turns less sits on the base, or nothing moved it
CLEARLY = 0.03  # share of the power by which a mounting out of square must be better
ALIKE = 0.02  # share of the power that decides between two links
FITS = 0.5  # share of the power left, above which no link explains a gyroscope
DEGREES = (20.0, 150.0)  # ratio of the rates at which the gyroscope must be in deg/s
ONE_AXIS = 1e-3  # share of the power about the other axes that shows a rotation
MIRRORED, WORTH_MIRRORING = 0.5, 0.1  # a reflection must leave less than this part, and that much less of the power
FEWEST = 10  # instants
MIRROR = np.diag([-1.0, 1.0, 1.0])  # from left-handed sensor coordinates to right-handed ones and back


@dataclass(frozen=True)
class Mount:
    """A gyroscope on a link.

    Attributes:
        body: link of the URDF.
        R_imu_body: from body to sensor coordinates, those with x turned where they are left-handed, shape (3, 3).
        left: share of the gyroscope's power that remains, 0 to 1.
        unit: of its values, "rad/s" or "deg/s".
        square: whether it is mounted in right angles.
        open_axis: the link turned about one axis only: the rotation about it is not known.
        others: links that explain it as well.
        left_handed: whether only a reflection explains it.
    """

    body: str
    R_imu_body: Array
    left: float
    unit: str
    square: bool
    open_axis: bool
    others: tuple[str, ...]
    left_handed: bool = False


@dataclass(frozen=True)
class SeenRate:
    """What a gyroscope measured, without its mean, and the motion of the joints at those instants.

    Attributes:
        measured: as in the bag, shape (m, 3).
        q, v: of the joints, shape (m, n) [rad], [rad/s].
    """

    measured: Array
    q: Array
    v: Array

    @property
    def power(self) -> float:
        """Mean square of the rate [unit of the bag squared]."""
        return float(np.mean(np.sum(self.measured**2, axis=1)))


def seen_rate(motion: JointMotion, gyro: Stream, most: int) -> SeenRate | None:
    """What a gyroscope saw; None where it has too few samples or stands still.

    Args:
        motion: of the joints.
        gyro: samples as they stand in the bag.
        most: number of instants that are enough.
    """
    if len(gyro.times) < FEWEST:
        return None
    inside = np.flatnonzero((motion.times > gyro.times[0]) & (motion.times < gyro.times[-1]))
    if len(inside) < FEWEST:
        return None
    chosen = inside[:: max(len(inside) // most, 1)]
    measured = window_mean(gyro, motion.times[chosen], motion.window)
    seen = SeenRate(measured - measured.mean(axis=0), motion.q[chosen], motion.v[chosen])
    return seen if seen.power > STANDS_STILL**2 else None


def find_mount(tree: RigidTree, seen: SeenRate, mirrored: bool = False, seats: Collection[str] = ()) -> Mount | None:
    """The link that a gyroscope sits on; None where no link explains it.

    Args:
        tree: the robot.
        seen: what the gyroscope and the encoders saw.
        mirrored: whether its frame may be left-handed.
        seats: links that it could sit on; all if empty.
    """
    found = all_mounts(tree, seen, mirrored, seats)
    if not found or found[0].left > FITS:
        return None
    others = tuple(m.body for m in found[1:] if m.left < found[0].left + ALIKE)
    return replace(found[0], others=others)


def least_left(tree: RigidTree, seen: SeenRate, seats: Collection[str] = ()) -> float:
    """Share of a gyroscope's power that remains at the best link, 1 where none explains it."""
    mount = find_mount(tree, seen, seats=seats)
    return 1.0 if mount is None else mount.left


def likely_seats(tree: RigidTree, seen: SeenRate, most: int) -> tuple[str, ...]:
    """The links that explain a gyroscope best, though none may do it well."""
    return tuple(mount.body for mount in all_mounts(tree, seen, True, ())[:most])


def all_mounts(tree: RigidTree, seen: SeenRate, mirrored: bool, seats: Collection[str]) -> list[Mount]:
    """The gyroscope on each link, best first."""
    mounts = (_on(tree, body, rate, seen, mirrored) for body, rate in _rates(tree, seen, seats))
    return sorted((mount for mount in mounts if mount is not None), key=lambda mount: mount.left)


def _rates(tree: RigidTree, seen: SeenRate, seats: Collection[str]) -> list[tuple[str, Array]]:
    """The first link behind every joint and its rate without its mean; further ones on the same joint turn alike."""
    first: dict[int, tuple[str, Array]] = {}
    for frame in tree.model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint > 0:
            first.setdefault(int(frame.parentJoint), (frame.name, frame.placement.rotation))
    chosen = {joint: body for joint, body in first.items() if not seats or body[0] in seats}
    rates = tree.joint_rates(seen.q, seen.v, chosen)
    found = [(body, rates[joint] @ R_joint_body) for joint, (body, R_joint_body) in chosen.items()]
    found = [(body, rate - rate.mean(axis=0)) for body, rate in found]
    return [(body, rate) for body, rate in found if np.mean(np.sum(rate**2, axis=1)) > STANDS_STILL**2]


def _on(tree: RigidTree, body: str, rate: Array, seen: SeenRate, mirrored: bool) -> Mount | None:
    """The gyroscope on one link; None where it stands still."""
    size = float(np.mean(np.sum(rate**2, axis=1)))
    ratio = float(np.sqrt(seen.power / size))
    unit = "deg/s" if DEGREES[0] < ratio < DEGREES[1] else "rad/s"
    measured = seen.measured * si_factor(unit)
    if np.mean(np.sum(measured**2, axis=1)) < STANDS_STILL**2:
        return None
    axes = np.linalg.svd(rate, compute_uv=False) ** 2
    open_axis = bool(axes[1] < ONE_AXIS * axes[0])
    proper = _turned(body, measured, rate, unit, open_axis)
    if not mirrored or open_axis:
        return proper
    other = replace(_turned(body, measured @ MIRROR, rate, unit, open_axis), left_handed=True)
    needed = other.left < MIRRORED * proper.left and other.left < proper.left - WORTH_MIRRORING
    return other if needed else proper


def _turned(body: str, measured: Array, rate: Array, unit: str, open_axis: bool) -> Mount:
    power, C = float(np.sum(measured**2)), measured.T @ rate
    both = power + float(np.sum(rate**2))
    right = _right_angles()
    square = right[int(np.argmax(np.einsum("kij,ij->k", right, C)))]
    left_square = (both - 2.0 * float(np.sum(square * C))) / power
    free = _wahba(C)
    left_free = (both - 2.0 * float(np.sum(free * C))) / power
    if left_free < left_square - CLEARLY:
        return Mount(body, free, left_free, unit, False, open_axis, ())
    return Mount(body, square, left_square, unit, True, open_axis, ())


def _wahba(C: Array) -> Array:
    """The rotation R with the largest tr(R^T C), shape (3, 3)."""
    U, _, Vt = np.linalg.svd(C)
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt, dtype=np.float64)


@cache
def _right_angles() -> Array:
    """The 24 rotations by right angles, the identity first, shape (24, 3, 3)."""
    found = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            R = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(R) > 0:
                found.append(R)
    return np.stack(found)
