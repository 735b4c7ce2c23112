# SPDX-License-Identifier: BSD-3-Clause
"""Coordinates of a model from the joints of a robot: q_model = G q + offset, v_model = G v.

A mimic joint is a row with its factor; joints in another order than the model's are a permutation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.urdf.mimic_joints import Follower

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coupling:
    """How the coordinates of a model follow n joints.

    Attributes:
        G: factors, shape (N, n).
        offset: shape (N,) [rad] or [m].
    """

    G: Array
    offset: Array

    @staticmethod
    def of(coordinates: Sequence[str], joints: Sequence[str], followers: Mapping[str, Follower]) -> Coupling | None:
        """The coupling of a model's coordinates, in its order, to joints; None where they are the same."""
        if tuple(coordinates) == tuple(joints):
            return None
        column = {joint: i for i, joint in enumerate(joints)}
        G, offset = np.zeros((len(coordinates), len(joints))), np.zeros(len(coordinates))
        for row, name in enumerate(coordinates):
            follower = followers.get(name, Follower(name)) if name not in column else Follower(name)
            G[row, column[follower.leader]], offset[row] = follower.factor, follower.offset
        return Coupling(G, offset)

    def positions(self, q: Array) -> Array:
        """Positions of the model for those of the joints, shape (..., N)."""
        return q @ self.G.T + self.offset

    def rates(self, v: Array) -> Array:
        """Velocities of the model for those of the joints, shape (..., N)."""
        return v @ self.G.T

    def limits(self, limits: Array) -> Array:
        """Lower and upper limit of each joint from those of the model, shapes (N, 2) and (n, 2): the tighter ones.

        A follower whose limits leave its joint no room (signs are easily mistaken there) limits nothing.
        """
        found = np.tile([-np.inf, np.inf], (self.G.shape[1], 1))
        own_first = sorted(zip(*np.nonzero(self.G), strict=True), key=lambda at: self.G[at] != 1.0)
        for row, column in own_first:
            ends = np.sort((limits[row] - self.offset[row]) / self.G[row, column])
            low, high = max(found[column, 0], ends[0]), min(found[column, 1], ends[1])
            if low < high:
                found[column] = low, high
        return found

    def velocity_limits(self, limits: Array) -> Array:
        """Velocity limit of each joint from those of the model, shapes (N,) and (n,)."""
        size = np.abs(self.G)
        return np.min(np.divide(limits[:, None], size, out=np.full(size.shape, np.inf), where=size > 0), axis=0)

    def torques(self, tau: Array) -> Array:
        """Torques of the joints from those of the model, shape (..., n)."""
        return tau @ self.G


def with_new_joints(joints: tuple[str, ...], new: tuple[str, ...], old: tuple[str, ...]) -> tuple[str, ...]:
    """Joints of a model with more coordinates: the new ones stand before the old one that comes after them.

    Args:
        joints: of the robot before.
        new: coordinates of the model.
        old: coordinates of the model before.
    """
    before: dict[str, list[str]] = {}
    waiting: list[str] = []
    for name in new:
        if name in old:
            before[name], waiting = waiting, []
        else:
            waiting.append(name)
    return tuple(name for joint in joints for name in (*before[joint], joint))
