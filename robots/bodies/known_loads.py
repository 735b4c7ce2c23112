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
    coupling, axes = tree.coupling, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    pulled = [bool(link) and bool(np.any(force)) for link, force in zip(links, forces, strict=True)]
    frames = {link: tree.frame_id(link) for link in {link for link, some in zip(links, pulled, strict=True) if some}}
    own = q if coupling is None else coupling.positions(q)
    J = np.zeros((len(q), 6, tree.model.nv))
    for i in (i for i, some in enumerate(pulled) if some):
        # a model of one joint gives a vector
        J[i] = pin.computeFrameJacobian(tree.model, tree.own.data, own[i], frames[links[i]], axes).reshape(6, -1)
    linear, angular = J[:, :3], J[:, 3:]
    torque = np.einsum("mck,mc->mk", linear, forces)
    # a column turns with every joint k before its own: dJ_j / dq_k = w_k x J_j, and dJ_k / dq_j is the same
    turned = np.einsum("mjc,mkc->mjk", np.swapaxes(linear, 1, 2), np.cross(forces[:, None], np.swapaxes(angular, 1, 2)))
    by_q = np.tril(turned) + np.swapaxes(np.tril(turned, -1), 1, 2)
    if coupling is not None:
        torque, by_q = torque @ coupling.G, coupling.G.T @ by_q @ coupling.G
    return KnownLoads(torque, by_q)
