# SPDX-License-Identifier: BSD-3-Clause
"""Moments of inertia of a body in the engine's order xx, yy, zz, xy, xz, yz."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def full_inertia(matrix: Array) -> Array:
    """The six numbers, shape (6,) [kg m2], of a symmetric matrix, shape (3, 3)."""
    return np.array([*np.diag(matrix), matrix[0, 1], matrix[0, 2], matrix[1, 2]])


def inertia_matrix(full: Array) -> Array:
    """The symmetric matrix, shape (3, 3) [kg m2], of six numbers, shape (6,)."""
    xx, yy, zz, xy, xz, yz = full
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def is_possible(full: Array) -> bool:
    """Whether a rigid body can have this inertia: all moments positive, none above the sum of the two others."""
    moments = np.linalg.eigvalsh(inertia_matrix(full))
    return bool(moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9))


def long_axis(full: Array) -> Array:
    """The principal axis of the least moment of inertia, unit vector, its largest component positive, shape (3,)."""
    axis = np.linalg.eigh(inertia_matrix(full))[1][:, 0]
    return axis * np.sign(axis[np.argmax(np.abs(axis))])
