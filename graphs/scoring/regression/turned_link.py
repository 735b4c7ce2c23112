# SPDX-License-Identifier: BSD-3-Clause
"""A link that seems to have its centre of mass elsewhere, and whose encoder may count from another zero instead.

An encoder that is off by a small angle turns the centre of mass of the last link about its axis,

    change of m c = angle (a x m c),

with the joint's axis a; a mass that is placed otherwise does so only by chance.
"""

from __future__ import annotations

import numpy as np

from jointscope.graphs.scoring.regression.wrong_links import WrongLink
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.model.turned_axes import joint_axis

ASTRAY = 0.2  # of the change, largest part that no turn about the axis makes


def turn_instead(tree: RigidTree, link: WrongLink) -> float | None:
    """How much too far an encoder reads [rad] if first moments do that; None where no turn of the last link does.

    Args:
        tree: bodies of the URDF.
        link: as the regression has it.
    """
    model = tree.model
    joint = model.getJointId(link.joint)
    if not link.moments or joint in list(model.parents)[1:]:  # links behind would be turned along
        return None
    body = model.inertias[joint]
    change = link.mass * body.lever + np.array(link.moments)
    turned = np.cross(joint_axis(model, joint), body.mass * body.lever)
    length = float(turned @ turned)
    if length <= 0.0:
        return None
    angle = float(change @ turned) / length
    left = float(np.linalg.norm(change - angle * turned))
    return -angle if left < ASTRAY * float(np.linalg.norm(change)) else None
