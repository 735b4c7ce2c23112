# SPDX-License-Identifier: BSD-3-Clause
"""Angular velocity of a body along its chain of joints, for many samples at once.

Placements and axes are read from pinocchio's model; the recursion goes from the base to the body:

    omega_i = Exp(-e_i q_i) R_i^T omega_(i-1) + e_i v_i        d/dq_i = -e_i x (Exp(-e_i q_i) R_i^T omega_(i-1))

One call per sample of pinocchio's frame derivatives gives the same (a test holds them together) and takes twenty times
as long.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Link:
    """One joint on the way: its column in q, placement rotation R_parent_joint, axis (zero for prismatic joints)."""

    column: int
    R_parent_joint: Array
    axis: Array


class BodyRates:
    """Body rates of one model.

    Args:
        model: pinocchio model with one-axis joints.
    """

    def __init__(self, model: pin.Model):
        self._model = model
        self._links: dict[int, _Link] = {}
        self._chains: dict[int, tuple[list[_Link], Array]] = {}

    def rate(self, frame: int, q: Array, v: Array) -> tuple[Array, Array, Array]:
        """Angular velocity of a frame in its own coordinates, with derivatives.

        Args:
            frame: index of the frame.
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].

        Returns:
            omega, shape (m, 3) [rad/s]; its derivatives by q and by v, each of shape (m, 3, n).
        """
        links, R_joint_frame = self._chain(frame)
        m, n = q.shape
        # columns: omega, derivatives by q, derivatives by v
        columns = np.zeros((m, 3, 1 + 2 * n))
        for link in links:
            R = turned_back(link.axis, q[:, link.column]) @ link.R_parent_joint.T
            columns = R @ columns
            columns[:, :, 1 + link.column] = -np.cross(link.axis, columns[:, :, 0])
            columns[:, :, 1 + n + link.column] = link.axis
            columns[:, :, 0] += link.axis * v[:, link.column, None]
        columns = R_joint_frame.T @ columns
        return columns[:, :, 0], columns[:, :, 1 : 1 + n], columns[:, :, 1 + n :]

    def of_joints(self, q: Array, v: Array, wanted: Collection[int] | None = None) -> dict[int, Array]:
        """Angular velocities of what moves, each in the frame behind its joint.

        Args:
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].
            wanted: indices of joints in the model; None for all.

        Returns:
            Rates by index of the joint in the model, each of shape (m, 3) [rad/s]; with those of all before them.
        """
        parents = self._model.parents
        needed = set(range(1, self._model.njoints) if wanted is None else wanted)
        for joint in range(self._model.njoints - 1, 0, -1):
            if joint in needed:
                needed.add(int(parents[joint]))
        rates = {0: np.zeros((len(q), 3))}
        for joint in sorted(needed - {0}):
            if joint not in self._links:
                self._links[joint] = self._link(joint)
            link = self._links[joint]
            R = turned_back(link.axis, q[:, link.column]) @ link.R_parent_joint.T
            rates[joint] = (R @ rates[parents[joint]][:, :, None])[:, :, 0] + link.axis * v[:, link.column, None]
        return rates

    def _chain(self, frame: int) -> tuple[list[_Link], Array]:
        """Joints from the base to a frame, and the frame's rotation on the last one."""
        if frame not in self._chains:
            joint = self._model.frames[frame].parentJoint
            links = []
            while joint > 0:
                links.append(self._link(joint))
                joint = self._model.parents[joint]
            self._chains[frame] = (links[::-1], self._model.frames[frame].placement.rotation.copy())
        return self._chains[frame]

    def _link(self, joint: int) -> _Link:
        axis = np.array(unit_motion(self._model, joint).angular)
        return _Link(self._model.joints[joint].idx_q, self._model.jointPlacements[joint].rotation.copy(), axis)


def unit_motion(model: pin.Model, joint: int) -> pin.Motion:
    """The motion that a unit velocity of a joint gives to what is behind it, in the axes there."""
    probe, unit = model.createData(), np.zeros(model.nv)
    unit[model.joints[joint].idx_v] = 1.0
    pin.forwardKinematics(model, probe, pin.neutral(model), unit)
    return probe.v[joint] - probe.liMi[joint].actInv(probe.v[model.parents[joint]])


def turned_back(axis: Array, angle: Array) -> Array:
    """Exp(-axis angle), shape (m, 3, 3); identity for a zero axis."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) - s * K + (1.0 - c) * (K @ K)


def skew(w: Array) -> Array:
    """Matrices [w]x with [w]x u = w x u, for vectors of shape (m, 3); shape (m, 3, 3)."""
    matrix = np.zeros((len(w), 3, 3))
    matrix[:, 0, 1], matrix[:, 0, 2], matrix[:, 1, 2] = -w[:, 2], w[:, 1], -w[:, 0]
    matrix[:, 1, 0], matrix[:, 2, 0], matrix[:, 2, 1] = w[:, 2], -w[:, 1], w[:, 0]
    return matrix
