# SPDX-License-Identifier: BSD-3-Clause
"""How sharply dry friction turns over, as a first guess where a joint is so slow that it matters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.drive_regression import PLACES, VISCOUS, DriveEquation
from jointscope.robots.bodies.rigid_tree import RigidTree

Array = NDArray[np.float64]

USUAL = 0.005  # [rad/s] within which the dry friction of a joint that turns is thought to turn over
MATTERS = 0.02  # of the rms speed, from which that is a good part of the motion
TURNS_OVER = 0.1  # of the rms speed at most, for a start


def turning_over(
    tree: RigidTree, equations: Sequence[DriveEquation], noise: Array, elastic: Sequence[str]
) -> list[float | None]:
    """First guess of k in tanh(k v) where it matters and can be seen; see `DriveValues.sharpness`."""
    found: list[float | None] = []
    for joint, equation, rough in zip(tree.joints, equations, noise.tolist(), strict=True):
        speed = float(equation.rms[PLACES[VISCOUS]])
        width = min(TURNS_OVER * speed, USUAL)
        matters = joint in tree.slides or speed < USUAL / MATTERS
        found.append(1.0 / width if matters and joint not in elastic and rough < width else None)
    return found
