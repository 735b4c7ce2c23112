# SPDX-License-Identifier: BSD-3-Clause
"""Specific force at a point of a body, what an accelerometer there feels, for many samples at once.

It is the acceleration of the point less that of gravity, f = a_point - g. The recursion begins with f = -g in the
base and goes along the chain of joints, as that of the angular velocities does:

    f(p) = f + alpha x p + omega x (omega x p)                                        to another point of a body
    omega_i = R omega + e v,   alpha_i = R alpha + e a + (R omega) x e v              through a joint that turns
    f_i = R f + alpha x s + omega x (omega x s) + 2 omega x u v + u a,   s = u q      through one that slides

with R = Exp(-e q) R_i^T. Derivatives by positions, velocities and accelerations go along as further columns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.body_rates import skew, turned_back
from jointscope.robots.bodies.joint_table import unit_motion

if TYPE_CHECKING:
    from jointscope.robots.bodies.rigid_tree import RigidTree

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SpecificForce:
    """What an accelerometer feels at m samples, in the axes of its body.

    Attributes:
        value: shape (m, 3) [m/s^2].
        by_q, by_v, by_a: derivatives by positions, velocities and accelerations, shape (m, 3, n) each.
        by_lever: derivative by the place of the sensor on its body, shape (m, 3, 3) [1/s^2].
    """

    value: Array
    by_q: Array
    by_v: Array
    by_a: Array
    by_lever: Array


@dataclass(frozen=True)
class ChainLink:
    """One joint on the way: column in q, placement, axis of its turn and of its slide (one of them zero)."""

    column: int
    R_parent_joint: Array
    p_parent: Array
    turn: Array
    slide: Array


def specific_force(
    tree: RigidTree, body: str, lever: Array, q: Array, v: Array, a: Array, gravity: Array | None = None
) -> SpecificForce:
    """What an accelerometer on a body feels: the acceleration of its place less that of gravity.

    Args:
        tree: rigid bodies.
        body: name of the link.
        lever: p_body of the sensor, shape (3,) [m].
        q: positions, shape (m, n) [rad].
        v: velocities, shape (m, n) [rad/s].
        a: accelerations, shape (m, n) [rad/s^2].
        gravity: in the base frame, shape (3,) [m/s^2]; None for that of the tree.
    """
    frame, coupling, chain = tree.frame_id(body), tree.coupling, tree.accelerations
    g = tree.gravity if gravity is None else gravity
    if coupling is None:
        return chain.at(frame, lever, g, q, v, a)
    found = chain.at(frame, lever, g, coupling.positions(q), coupling.rates(v), coupling.rates(a))
    by_q, by_v, by_a = (J @ coupling.G for J in (found.by_q, found.by_v, found.by_a))
    return replace(found, by_q=by_q, by_v=by_v, by_a=by_a)


class BodyAccelerations:
    """Specific forces of one model.

    Args:
        model: pinocchio model with one-axis joints.
    """

    def __init__(self, model: pin.Model):
        self._model = model
        self._chains: dict[int, list[ChainLink]] = {}

    def at(self, frame: int, lever: Array, gravity: Array, q: Array, v: Array, a: Array) -> SpecificForce:
        """Specific force at a point of a frame.

        Args:
            frame: index of the frame.
            lever: p_frame of the point, shape (3,) [m].
            gravity: in the base frame, shape (3,) [m/s^2].
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].
            a: accelerations, shape (m, n) [rad/s^2].
        """
        m, n = q.shape
        # columns: the value, then its derivatives by q, v and a
        omega, alpha = np.zeros((m, 3, 1 + 3 * n)), np.zeros((m, 3, 1 + 3 * n))
        force = np.zeros((m, 3, 1 + 3 * n))
        force[:, :, 0] = -gravity
        for link in self.chain(frame):
            j = link.column
            force = _moved(force, alpha, omega, link.p_parent)
            R = turned_back(link.turn, q[:, j]) @ link.R_parent_joint.T
            omega, alpha, force = R @ omega, R @ alpha, R @ force
            if np.any(link.turn):
                omega, alpha, force = _turned(link.turn, j, n, v[:, j], a[:, j], omega, alpha, force)
            else:
                force = _slid(link.slide, j, n, q[:, j], v[:, j], a[:, j], omega, alpha, force)
        placement = self._model.frames[frame].placement
        force = _moved(force, alpha, omega, placement.translation)
        R = placement.rotation.T
        omega, alpha, force = R @ omega, R @ alpha, R @ force
        W = skew(omega[:, :, 0])
        f = _moved(force, alpha, omega, lever)
        by_lever = skew(alpha[:, :, 0]) + W @ W
        return SpecificForce(f[:, :, 0], f[:, :, 1 : 1 + n], f[:, :, 1 + n : 1 + 2 * n], f[:, :, 1 + 2 * n :], by_lever)

    def chain(self, frame: int) -> list[ChainLink]:
        """Joints from the base to a frame, by its index."""
        if frame not in self._chains:
            joint, links = self._model.frames[frame].parentJoint, []
            while joint > 0:
                links.append(self._link(joint))
                joint = self._model.parents[joint]
            self._chains[frame] = links[::-1]
        return self._chains[frame]

    def _link(self, joint: int) -> ChainLink:
        placement, motion = self._model.jointPlacements[joint], unit_motion(self._model, joint)
        turn = np.array(motion.angular)
        slide = np.zeros(3) if np.any(turn) else np.array(motion.linear)
        column = self._model.joints[joint].idx_q
        return ChainLink(column, placement.rotation.copy(), placement.translation.copy(), turn, slide)


def _turned(
    e: Array, j: int, n: int, v: Array, a: Array, omega: Array, alpha: Array, force: Array
) -> tuple[Array, Array, Array]:
    """Through a joint that turns about e; the arguments are in its axes, without its own motion."""
    for columns in (omega, alpha, force):
        columns[:, :, 1 + j] -= np.cross(e, columns[:, :, 0])
    E = skew(np.broadcast_to(e, (len(v), 3)))
    alpha = alpha - v[:, None, None] * (E @ omega)  # (R omega) x e v
    alpha[:, :, 1 + n + j] -= np.cross(e, omega[:, :, 0])
    alpha[:, :, 0] += e * a[:, None]
    alpha[:, :, 1 + 2 * n + j] += e
    omega[:, :, 0] += e * v[:, None]
    omega[:, :, 1 + n + j] += e
    return omega, alpha, force


def _slid(u: Array, j: int, n: int, q: Array, v: Array, a: Array, omega: Array, alpha: Array, force: Array) -> Array:
    """Force behind a joint that slides along u."""
    U = skew(np.broadcast_to(u, (len(v), 3)))
    W, A = skew(omega[:, :, 0]), skew(alpha[:, :, 0])
    moved = q[:, None, None] * _along(alpha, omega, u) - 2.0 * v[:, None, None] * (U @ omega)
    moved[:, :, 1 + j] += ((A + W @ W) @ u[:, None])[:, :, 0]
    moved[:, :, 1 + n + j] += 2.0 * (W @ u[:, None])[:, :, 0]
    moved[:, :, 0] += u * a[:, None]
    moved[:, :, 1 + 2 * n + j] += u
    return force + moved


def _moved(force: Array, alpha: Array, omega: Array, p: Array) -> Array:
    """Force at another point p of the same body, with its derivatives."""
    return force + _along(alpha, omega, p) if np.any(p) else force


def _along(alpha: Array, omega: Array, p: Array) -> Array:
    """The columns of alpha x p + omega x (omega x p)."""
    P = skew(np.broadcast_to(p, (len(omega), 3)))
    W, Wp = skew(omega[:, :, 0]), skew(np.cross(omega[:, :, 0], p))
    inward = -(W @ P + Wp) @ omega  # d(w x (w x p)) = -w x (p x dw) - (w x p) x dw
    inward[:, :, 0] *= 0.5  # the product is of second order in omega
    return -(P @ alpha) + inward
