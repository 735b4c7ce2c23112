# SPDX-License-Identifier: BSD-3-Clause
"""Joints whose axes do not stand as the URDF says: turned about the two coordinate axes of their frame across the axis.

    P_j = P_j,model Exp(x e_x + y e_y)

with the placement P_j of the joint in the link before it. What the joint moves is turned along with the axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.urdf.motion_axis import motion_axis

Array = NDArray[np.float64]
STEP = 1e-4  # [rad] of central differences: both rounding and bend are below 1e-8 of the torque


@dataclass(frozen=True)
class TurnedAxis:
    """Two parameters that turn the axis of a joint.

    Attributes:
        names: full names of both.
        joint: index of the joint in pinocchio's model.
    """

    names: tuple[str, ...]
    joint: int

    @staticmethod
    def of(here: EffectAt, model: pin.Model) -> TurnedAxis:
        """The axis of an effect's owner."""
        return TurnedAxis(tuple(here.parameter(p.name) for p in here.effect.parameters), model.getJointId(here.owner))

    def turned(self, model: pin.Model, angles: Array) -> None:
        """Turns the axis of a model further by two angles, shape (2,) [rad]."""
        turn = np.zeros(3)
        turn[list(across_axes(model, self.joint))] = angles
        model.jointPlacements[self.joint] = model.jointPlacements[self.joint] * pin.SE3(pin.exp3(turn), np.zeros(3))


def turn_torques(tree: RigidTree, axis: TurnedAxis, motion: tuple[Array, Array, Array]) -> list[Array]:
    """Torque that a unit of each angle asks for, from where the axis stands, shape (m, n_link) each [N m/rad].

    Args:
        tree: the bodies.
        axis: which is turned.
        motion: positions, velocities and accelerations, shape (m, n_link) each.
    """

    def torque(turn: Array) -> Array:
        model = tree.model.copy()
        axis.turned(model, turn)
        return tree.with_model(model).torque(*motion)

    return [(torque(step) - torque(-step)) / (2.0 * STEP) for step in STEP * np.eye(2)]


def across_axes(model: pin.Model, joint: int) -> tuple[int, int]:
    """The two coordinate axes of a joint's frame that lie across its axis, in order."""
    first, second = np.sort(np.argsort(np.abs(joint_axis(model, joint)))[:2])
    return int(first), int(second)


def joint_axis(model: pin.Model, joint: int) -> Array:
    """Axis of a revolute joint in its own frame, shape (3,); zero for a prismatic one."""
    return motion_axis(model.joints[joint])[3:]
