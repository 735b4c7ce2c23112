# SPDX-License-Identifier: BSD-3-Clause
"""Where a point of a body is in the base, for many samples at once.

The recursion goes from the point along the chain of joints to the base:

    p = p_parent + R_parent Exp(e q) p      through a joint that turns about e,   d/dq = R_parent Exp(e q) (e x p)
    p = p_parent + R_parent (p + u q)       through one that slides along u,      d/dq = R_parent u

Derivatives by positions and by the point on its body go along as further columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.body_rates import turned_back
from jointscope.robots.bodies.rigid_tree import RigidTree

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodyPoint:
    """A point of a body at m samples, in the axes of the base.

    Attributes:
        value: shape (m, 3) [m].
        by_q: derivative by positions, shape (m, 3, n).
        R_base_body: rotation of the body, which is the derivative by the place of the point on it, shape (m, 3, 3).
    """

    value: Array
    by_q: Array
    R_base_body: Array


def body_point(tree: RigidTree, body: str, p_body: Array, q: Array) -> BodyPoint:
    """Where a point of a body is in the base.

    Args:
        tree: rigid bodies.
        body: name of the link.
        p_body: the point in its axes, shape (3,) [m].
        q: positions, shape (m, n) [rad].
    """
    frame, coupling = tree.frame_id(body), tree.coupling
    q_model = q if coupling is None else coupling.positions(q)
    m, n = q_model.shape
    placement = tree.model.frames[frame].placement
    columns = np.zeros((m, 3, 1 + n + 3))  # the value, its derivatives by q, the rotation
    columns[:, :, 0] = placement.rotation @ p_body + placement.translation
    columns[:, :, 1 + n :] = placement.rotation
    for link in reversed(tree.accelerations.chain(frame)):
        if np.any(link.turn):
            columns[:, :, 1 + link.column] = np.cross(link.turn, columns[:, :, 0])
            columns = turned_back(link.turn, -q_model[:, link.column]) @ columns
        else:
            columns[:, :, 1 + link.column] = link.slide
            columns[:, :, 0] += q_model[:, link.column, None] * link.slide
        columns = link.R_parent_joint @ columns
        columns[:, :, 0] += link.p_parent
    by_q = columns[:, :, 1 : 1 + n]
    return BodyPoint(columns[:, :, 0], by_q if coupling is None else by_q @ coupling.G, columns[:, :, 1 + n :])
