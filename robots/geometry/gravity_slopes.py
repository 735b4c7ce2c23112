# SPDX-License-Identifier: BSD-3-Clause
"""How the torques of gravity about all axes that give way change with angles, geometry and masses of an arm.

    tau_a = u_a' (L_a x g),    d tau_a / d turn about u_b = u_first' ((u_last x L_last) x g)

first and last are a and b in their order along the chain, L_a is the first moment about joint a of all that it carries:
the Hessian of a potential, so that it is symmetric.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS
from jointscope.robots.geometry.arm_chain import ChainPoint, cross
from jointscope.robots.geometry.error_parameters import LINK_MASS, LINK_MOMENTS, PAYLOAD, TOOL

Array = NDArray[np.float64]
YIELDING = (2, 4, 3)  # the joint, x', y' among the turns at a joint: what gives way under its torque


@dataclass(frozen=True)
class GravitySlopes:
    """Slopes of the torques about all joints, then about x' and then about y' of all their bearings.

    Attributes:
        by_turn: by turns about the same axes, shape (m, 3 n, 3 n) [N m/rad].
        by_value: by each geometric error and mass, by name, shape (m, 3 n).
    """

    by_turn: Array
    by_value: Mapping[str, Array]


def gravity_slopes(joints: Sequence[str], point: ChainPoint, g: Array) -> GravitySlopes:
    """Slopes at some poses.

    Args:
        joints: names, base to tip.
        point: the arm in these poses.
        g: acceleration of gravity in the base frame, shape (3,) [m/s^2].
    """
    m, n = point.gravity.shape
    turns, joint_of = point.turns.reshape(m, 5 * n, 3), np.repeat(np.arange(n), 5)
    swung = cross(cross(turns, point.moments[:, joint_of]), g)
    H = np.triu(turns @ np.swapaxes(swung, 1, 2))
    H = H + np.swapaxes(np.triu(H, 1), 1, 2)
    axes = np.concatenate([np.arange(n) * 5 + k for k in YIELDING])
    owner = np.tile(np.arange(n), 3)
    levers = cross(g, turns[:, axes])  # a mass m that moves by a changes tau by m a' (g x u)
    found: dict[str, Array] = {}
    for j, joint in enumerate(joints):
        found |= {f"{joint}.{part}": H[:, axes, 5 * j + k] for k, part in enumerate(ANGLES)}
        moved = np.where(owner < j, point.masses[j], 0.0)
        for part in LENGTHS:
            found[f"{joint}.{part}"] = moved * _along(levers, point.steps[f"{joint}.{part}"])
        away = point.centres[:, j, None] - point.origins[:, owner]
        found[f"{joint}.{LINK_MASS}"] = np.where(owner <= j, np.sum(levers * away, axis=2), 0.0)
        for k, part in enumerate(LINK_MOMENTS):
            found[f"{joint}.{part}"] = np.where(owner <= j, _along(levers, point.frames[:, j, :, k]), 0.0)
    carrying = owner <= point.level  # of the target
    for part in LENGTHS:
        found[f"{TOOL}.{part}"] = point.payload * carrying * _along(levers, point.steps[f"{TOOL}.{part}"])
    found[PAYLOAD] = carrying * np.sum(levers * (point.target[:, None] - point.origins[:, owner]), axis=2)
    return GravitySlopes(H[:, axes[:, None], axes], found)


def _along(levers: Array, step: Array) -> Array:
    """Levers (m, 3 n, 3) along a step of each pose, shape (m, 3)."""
    return np.einsum("mak,mk->ma", levers, step)
