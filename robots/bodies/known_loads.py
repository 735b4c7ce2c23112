# SPDX-License-Identifier: BSD-3-Clause
"""Torques of forces that hang on links: tau = J(q)^T F, with F at the origin of a link, in the axes of the base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree

Array = NDArray[np.float64]
STEP = 1e-5  # [rad] of the differences that make the derivative, which is exact to 1e-9


@dataclass(frozen=True)
class KnownLoads:
    """Torques of known forces about the coordinates of the links.

    Attributes:
        torque: shape (m, n) [N m].
        by_q: derivative by the positions, shape (m, n, n) [N m/rad].
    """

    torque: Array
    by_q: Array


def known_loads(tree: RigidTree, links: Sequence[str], forces: Array, q: Array) -> KnownLoads:
    """Torques of one force in each of m postures.

    Args:
        tree: the bodies.
        links: name of the link that each force acts on; "" where there is none.
        forces: shape (m, 3) [N].
        q: positions, shape (m, n) [rad].

    Raises:
        RobotError: no such link.
    """
    torque = _torques(tree, links, forces, q)
    by_q = np.zeros((*q.shape, q.shape[1]))
    for k in range(q.shape[1]) if np.any(forces) else ():
        h = STEP * np.eye(q.shape[1])[k]
        by_q[:, :, k] = (_torques(tree, links, forces, q + h) - _torques(tree, links, forces, q - h)) / (2.0 * STEP)
    return KnownLoads(torque, by_q)


def _torques(tree: RigidTree, links: Sequence[str], forces: Array, q: Array) -> Array:
    found, coupling, axes = np.zeros_like(q), tree.coupling, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    pulled = forces.any(axis=1).tolist()
    frames = {link: tree.frame_id(link) for link in {link for link, some in zip(links, pulled, strict=True) if link and some}}
    for i, (link, force) in enumerate(zip(links, forces, strict=True)):
        if link and pulled[i]:
            own = q[i] if coupling is None else coupling.positions(q[i : i + 1])[0]
            J = pin.computeFrameJacobian(tree.model, tree.data, own, frames[link], axes)[:3]
            found[i] = (J if coupling is None else J @ coupling.G).T @ force
    return found
