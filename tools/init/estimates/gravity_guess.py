# SPDX-License-Identifier: BSD-3-Clause
"""Which way gravity points in the base frame, where the usual way contradicts the recording.

Robots hang from ceilings, stand on walls, or have their weight compensated; a URDF says nothing of that. Torques that
the equation of motion explains with one direction alone do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.graphs.starts.drive_regression import GAIN, DriveEquation
from jointscope.robots.bodies.rigid_tree import RigidTree

Array = NDArray[np.float64]

STANDARD = 9.81  # [m/s^2]
DOUBTFUL = 0.99  # of the torque's mean square of some joint: where less is explained, the usual direction is doubted
EXPLAINED = 0.9  # of every joint that another direction must explain
CLEARER = 0.25  # of the missing torque's mean square that another direction may leave at most
OTHERS = {
    "none: the weight is compensated": (0.0, 0.0, 0.0),
    "the base hangs upside down": (0.0, 0.0, STANDARD),
    "the base is mounted on a wall": (STANDARD, 0.0, 0.0),
    "the base is mounted on a wall, the other way round": (-STANDARD, 0.0, 0.0),
    "the base is mounted on a wall, on its side": (0.0, STANDARD, 0.0),
    "the base is mounted on a wall, on its other side": (0.0, -STANDARD, 0.0),
}


def clearer_gravity(
    tree: RigidTree, equations_of: Callable[[RigidTree], Sequence[DriveEquation]]
) -> tuple[RigidTree, Sequence[DriveEquation], str]:
    """The tree with the gravity that the recording asks for, its equations, and why; the same tree where that will do.

    Args:
        tree: with gravity as it usually is.
        equations_of: equations of the drives of a tree.
    """
    equations = equations_of(tree)
    usual = _missing(equations)
    if not len(usual) or np.max(usual) <= 1.0 - DOUBTFUL:
        return tree, equations, ""
    found = []
    for words, gravity in OTHERS.items():
        other = _with_gravity(tree, gravity)
        now = equations_of(other)
        missing = _missing(now)
        if len(missing) == len(usual):
            found.append((float(np.sum(missing)), float(np.max(missing)), words, other, now))
    if not found:
        return tree, equations, ""
    total, worst, words, best, its = min(found, key=lambda entry: entry[0])
    if total > CLEARER * float(np.sum(usual)) or worst > 1.0 - EXPLAINED:
        return tree, equations, ""
    shares = f"{_percent(total / len(usual))} of the torque is explained so, {_percent(float(np.mean(usual)))} with -z"
    return best, its, f"{words}: {shares}"


def _percent(missing: float) -> str:
    return f"{100.0 * max(1.0 - missing, 0.0):.3g} %"


def _missing(equations: Sequence[DriveEquation]) -> Array:
    """Share of each driving torque's mean square that is missing, shape (k,), of those that can be told."""
    shares = []
    for equation in equations:
        values = {name: value.value for name, value in equation.solve().items()}
        if values:
            # a drive that makes no torque explains nothing
            gain = values[GAIN]
            shares.append((equation.missing(values) / max(equation.torque(gain), 1e-300)) ** 2)
    return np.array(shares)


def _with_gravity(tree: RigidTree, gravity: Sequence[float]) -> RigidTree:
    model = tree.model.copy()
    model.gravity = pin.Motion(np.array(gravity), np.zeros(3))
    other = tree.with_model(model)
    other.joints, other.gravity = tree.joints, np.array(gravity)
    return other
