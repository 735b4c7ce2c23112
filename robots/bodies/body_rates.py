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
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.coupling import Coupling
from jointscope.robots.bodies.joint_table import JointTable, unit_motion

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
        coupling: its coordinates from those of the joints; None where they are the same.
    """

    def __init__(self, model: pin.Model, coupling: Coupling | None = None):
        self._model, self._coupling = model, coupling
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
        q, v = self._of_model(q, v)
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
        return columns[:, :, 0], self._by_joints(columns[:, :, 1 : 1 + n]), self._by_joints(columns[:, :, 1 + n :])

    def sensed(
        self, frame: int, R_sensor_frame: Array, q: Array, v: Array, derivatives: bool
    ) -> tuple[Array, Array, Array]:
        """As `rate`, in the axes of a sensor on the frame, by a compiled loop over samples.

        Args:
            frame: index of the frame.
            R_sensor_frame: rotation of its axes into those of the sensor, shape (3, 3).
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].
            derivatives: whether they are wanted; else they come back with length 0.
        """
        from jointscope.robots.bodies.chain_recursion import body_rates  # numba takes half a second to import

        links, R_joint_frame = self._chain(frame)
        table, joint = self._table, self._model.frames[frame].parentJoint
        R_sensor_axes = R_sensor_frame @ R_joint_frame.T @ table.R_joint_axes[joint]
        q, v = self._of_model(q, v)
        m, n = q.shape
        wanted = m * derivatives
        omega, by_q, by_v = np.empty((m, 3)), np.empty((wanted, 3, n)), np.empty((wanted, 3, n))
        chain = np.array([link.column for link in links], dtype=np.intp)
        motion = (np.ascontiguousarray(x, dtype=np.float64) for x in (q, v))
        body_rates(chain, table.rows, np.ascontiguousarray(R_sensor_axes), *motion, omega, by_q, by_v)
        return omega, self._by_joints(by_q), self._by_joints(by_v)

    @cached_property
    def _table(self) -> JointTable:
        return JointTable.of(self._model)

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
        q, v = self._of_model(q, v)
        rates = {0: np.zeros((len(q), 3))}
        for joint in sorted(needed - {0}):
            if joint not in self._links:
                self._links[joint] = self._link(joint)
            link = self._links[joint]
            R = turned_back(link.axis, q[:, link.column]) @ link.R_parent_joint.T
            rates[joint] = (R @ rates[parents[joint]][:, :, None])[:, :, 0] + link.axis * v[:, link.column, None]
        return rates

    def _of_model(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Positions and velocities of the model for those of the joints."""
        coupling = self._coupling
        return (q, v) if coupling is None else (coupling.positions(q), coupling.rates(v))

    def _by_joints(self, by: Array) -> Array:
        """Derivatives by the joints from those by the coordinates of the model."""
        return by if self._coupling is None else by @ self._coupling.G

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
