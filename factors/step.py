# SPDX-License-Identifier: BSD-3-Clause
"""What the three dynamics factors share: the steps between ticks, their commands and their noise.

Variables: X(k), X(k+1), dynamics. Disturbances are torques: the link rows are turned from velocities into impulses by
the mass matrix at the measured angles (a known weight W, stated on the mean inertia of each joint so that it keeps the
unit of a velocity). The residual of step k has two halves: velocities d_v and positions d_q - (h/2) d_v. White noise on
the velocities with density s makes the two halves independent, with standard deviations s sqrt(h) and s h sqrt(h/12);
so the positions follow from the velocities and need no noise of their own. With `independent` position noise (eq. 36 of
Schuethe et al. 2016) the second half is d_q itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.factor import Samples
from jointscope.robots.robot import ProcessNoise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Steps:
    """Steps between consecutive ticks.

    Attributes:
        h: length of each step, shape (m,) [s].
        u: command that acts during each step, shape (m, n), SI unit of the command.
        noise: densities of the process noise.
        weight: W of each step, shape (m, n, n); None for the identity.
    """

    h: Array
    u: Array
    noise: ProcessNoise
    weight: Array | None = None

    def __len__(self) -> int:
        return len(self.h)

    def select(self, samples: Samples) -> Steps:
        """Some of the steps."""
        weight = None if self.weight is None else self.weight[samples]
        return Steps(self.h[samples], self.u[samples], self.noise, weight)

    @property
    def integrated(self) -> bool:
        """Whether the position noise follows from the velocity noise."""
        return self.noise.model == "integrated"

    @property
    def sigmas(self) -> Array:
        """Standard deviations of the rows (velocities, then positions; link before motor), shape (m, 4n)."""
        density = np.concatenate([self.noise.link_velocity, self.noise.motor_velocity])
        root = np.sqrt(self.h)[:, None]
        velocity = density * root
        if self.integrated:
            return np.hstack([velocity, velocity * self.h[:, None] / np.sqrt(12.0)])
        return np.hstack([velocity, np.broadcast_to(self.noise.position * root, velocity.shape)])

    def combine(self, d_v: Array, d_q: Array) -> Array:
        """Stacks velocity and position defects (axis 1) into the rows whose noise is independent."""
        if not self.integrated:
            return np.concatenate([d_v, d_q], axis=1)
        half = (0.5 * self.h).reshape(-1, *([1] * (d_v.ndim - 1)))
        return np.concatenate([self._weighted(d_v), self._weighted(d_q - half * d_v)], axis=1)

    def _weighted(self, defect: Array) -> Array:
        """Link rows as impulses on the mean inertia, motor rows as they are."""
        if self.weight is None:
            return defect
        n = self.weight.shape[1]
        columns = defect[:, :n].reshape(len(defect), n, -1)
        link = (self.weight @ columns).reshape(defect[:, :n].shape)
        return np.concatenate([link, defect[:, n:]], axis=1)


def row_names(joints: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the rows of a dynamics factor."""
    sides = [f"{joint}.link" for joint in joints] + [f"{joint}.motor" for joint in joints]
    return tuple(f"{side}_{half}" for half in ("velocity", "position") for side in sides)


def selectors(n: int) -> tuple[Array, Array]:
    """Matrices that pick all positions, and all velocities (link, then motor) from a state, shape (2n, 4n)."""
    eye, zero = np.eye(n), np.zeros((n, n))
    positions = np.block([[eye, zero, zero, zero], [zero, zero, eye, zero]])
    velocities = np.block([[zero, eye, zero, zero], [zero, zero, zero, eye]])
    return positions, velocities


def positions_of(x: Array) -> Array:
    """Link, then motor positions of states, shape (m, 2n)."""
    n = x.shape[1] // 4
    return np.hstack([x[:, :n], x[:, 2 * n : 3 * n]])


def velocities_of(x: Array) -> Array:
    """Link, then motor velocities of states, shape (m, 2n)."""
    n = x.shape[1] // 4
    return np.hstack([x[:, n : 2 * n], x[:, 3 * n :]])
