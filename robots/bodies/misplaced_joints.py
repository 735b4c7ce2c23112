# SPDX-License-Identifier: BSD-3-Clause
"""Joints that are not quite where the URDF has them: where each is mounted, how its axis is tilted, its encoder's zero.

    T = (P, p + l) -> R = P Ry'(mis_y) Rx'(mis_x) Ra(offset)

a is the axis of the joint, x' the x axis of its frame (y for joints about x), y' = a x x' (Neubauer et al. 2015,
Sec. 3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.urdf.motion_axis import motion_axis

Array = NDArray[np.float64]
LENGTHS = ("lx", "ly", "lz")  # [m] in the axes of the link before
ANGLES = ("mis_y", "mis_x", "offset")  # [rad] in the order in which they turn
ALONG_X = 0.9  # cosine from which an axis is along x, so that y takes its place as the direction across


def misplacement_names(joints: Sequence[str]) -> tuple[str, ...]:
    """Full names of all errors of these joints."""
    return tuple(f"{joint}.{part}" for joint in joints for part in (*LENGTHS, *ANGLES))


def misplaced(placement: pin.SE3, joint: str, errors: Mapping[str, float], axes: tuple[Array, Array, Array]) -> pin.SE3:
    """Where a joint is with its errors.

    Args:
        placement: where it is without, in the axes of the link before.
        joint: its name.
        errors: by full name; 0 where there is none [m], [rad].
        axes: a, x' and y' of `across`.
    """
    along, x, y = axes
    R = np.array(placement.rotation)
    for part, axis in (("mis_y", y), ("mis_x", x), ("offset", along)):
        R = R @ turned(axis, np.array(errors.get(f"{joint}.{part}", 0.0)))
    shift = np.array([errors.get(f"{joint}.{part}", 0.0) for part in LENGTHS])
    return pin.SE3(R, np.array(placement.translation) + shift)


def misplace(model: pin.Model, errors: Mapping[str, float]) -> None:
    """Puts errors of joints, by full name [m], [rad], into a model."""
    for joint in {name.rpartition(".")[0] for name, error in errors.items() if error}:
        j = model.getJointId(joint)
        axes = across(motion_axis(model.joints[j])[3:])
        model.jointPlacements[j] = misplaced(model.jointPlacements[j], joint, errors, axes)


def across(along: Array) -> tuple[Array, Array, Array]:
    """The axis of a joint, and the two directions across it, x' and y'."""
    x = np.eye(3)[1 if abs(along[0]) > ALONG_X else 0]
    x = x - along * (along @ x)
    x = x / np.linalg.norm(x)
    return along, x, np.cross(along, x)


def turned(axis: Array, angle: Array) -> Array:
    """Rotations about one axis, shape (m, 3, 3) or (3, 3)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = angle[..., None, None]
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K))
