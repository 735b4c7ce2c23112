# SPDX-License-Identifier: BSD-3-Clause
"""Joints and bodies of a pinocchio model in rows of numbers, for compiled recursions over the joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]

# columns: rotation into the frame of the joint before and origin there [m]; 1 for a joint that turns, 0 for one that
# slides; mass [kg], mass times centre [kg m] and second moments int r r' dm [kg m2] of the body about the joint;
# inertia of the rotor [kg m2]. Numbers of numpy: numba compiles no function anew for each of them.
ROTATION, ORIGIN, TURNS, MASS, FIRST, SECOND, ARMATURE, COLUMNS = np.cumsum((0, 9, 3, 1, 1, 3, 9, 1))


@dataclass(frozen=True)
class JointTable:
    """A model with one-axis joints, each seen in a frame whose z axis is its own.

    Attributes:
        parents: joint before each, -1 for the base, shape (n,).
        rows: columns as above, shape (n, 27).
        gravity: acceleration in the base frame, shape (3,) [m/s^2].
        R_joint_axes: the frames of the rows in those of pinocchio's joints, the base first, shape (n + 1, 3, 3).
    """

    parents: NDArray[np.intp]
    rows: Array
    gravity: Array
    R_joint_axes: Array

    @staticmethod
    def of(model: pin.Model) -> JointTable:
        """The table of a model."""
        rows, frames = np.zeros((model.nv, int(COLUMNS))), [np.eye(3)]
        for joint in range(1, model.njoints):
            motion, parent = unit_motion(model, joint), model.parents[joint]
            turns = bool(np.any(motion.angular))
            z = motion.angular if turns else motion.linear
            x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
            x /= np.linalg.norm(x)
            R, R_before, placement = (
                np.column_stack([x, np.cross(z, x), z]),
                frames[parent],
                model.jointPlacements[joint],
            )
            frames.append(R)
            row = rows[joint - 1]
            row[ROTATION:ORIGIN] = (R_before.T @ placement.rotation @ R).ravel()
            row[ORIGIN:TURNS] = R_before.T @ placement.translation
            row[TURNS], row[MASS:ARMATURE] = float(turns), _body(model.inertias[joint].toDynamicParameters(), R)
        rows[:, ARMATURE] = model.armature
        parents = np.array(model.parents, dtype=np.intp)[1:] - 1
        return JointTable(parents, rows, np.array(model.gravity.linear), np.array(frames))

    def with_bodies(self, joints: Sequence[int], parameters: Array) -> tuple[NDArray[np.intp], Array]:
        """Bodies alone: rows of their joints, shape (c,), and rows that hold nothing but them, shape (c, 27).

        Args:
            joints: index in pinocchio's model of the joint that moves each body.
            parameters: dynamic parameters of pinocchio, or changes of them, shape (c, 10).
        """
        rows = np.zeros((len(joints), int(COLUMNS)))
        for row, joint, ten in zip(rows, joints, parameters, strict=True):
            row[MASS:ARMATURE] = _body(ten, self.R_joint_axes[joint])
        return np.array(joints, dtype=np.intp) - 1, rows


def _body(parameters: Array, R: Array) -> Array:
    """Mass, first and second moments in the axes of a row, shape (13,)."""
    xx, xy, yy, xz, yz, zz = parameters[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    second = R.T @ (0.5 * np.trace(inertia) * np.eye(3) - inertia) @ R
    return np.concatenate([parameters[:1], R.T @ parameters[1:4], second.ravel()])


def unit_motion(model: pin.Model, joint: int) -> pin.Motion:
    """The motion that a unit velocity of a joint gives to what is behind it, in the axes there."""
    probe, unit = model.createData(), np.zeros(model.nv)
    unit[model.joints[joint].idx_v] = 1.0
    pin.forwardKinematics(model, probe, pin.neutral(model), unit)
    return probe.v[joint] - probe.liMi[joint].actInv(probe.v[model.parents[joint]])
