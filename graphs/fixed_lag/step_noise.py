# SPDX-License-Identifier: BSD-3-Clause
"""Process noise of one step at one state: the whitening of the defects of the dynamics factor, and its inverse.

The same rows as `factors.step`: velocity defects d_v and d_q - (h/2) d_v, link rows turned into impulses by
W = M(q) / (inertia alone), with standard deviations s sqrt(h) and s h sqrt(h/12).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.robot import Robot

Array = NDArray[np.float64]

SAME_POSITION = 0.01  # [rad] inertia weighs the noise; within this it does so as before, to a percent


class StepNoise:
    """Noise of the steps of one robot.

    Args:
        robot: its noise and layout.
    """

    def __init__(self, robot: Robot):
        self._layout, noise = robot.layout, robot.noise
        self._integrated, self._position = noise.model == "integrated", noise.position
        self._density = np.concatenate([noise.link_velocity, noise.motor_velocity, noise.memory])
        # the bodies of the URDF, as where the noise was estimated; effects on inertia do not enter the weights
        self._tree = robot.kinematic_tree
        M = self._mass_matrix(np.zeros(robot.layout.n_link))
        self._alone = 1.0 / np.diag(np.linalg.inv(M))
        self._kept: tuple[Array, float, tuple[Array, Array]] | None = None

    def of_step(self, x: Array, h: float, extra: Array | None = None) -> tuple[Array, Array]:
        """Whitening T and its inverse G: T defect is white with unit variance, defect = G n.

        Args:
            x: state at which the inertia is taken, shape (d,).
            h: length of the step [s].
            extra: further standard deviation of each velocity and memory over the step, shape (r,).

        Returns:
            Shapes (d, d); columns of T and rows of G are those of the state, rows of T velocities and memories first.
        """
        q = x[self._layout.q_link]
        if extra is None and self._kept is not None:
            at, length, found = self._kept
            if length == h and np.abs(q - at).max() < SAME_POSITION:
                return found
        found = self._computed(x, h, extra)
        if extra is None:
            self._kept = q, h, found
        return found

    def _computed(self, x: Array, h: float, extra: Array | None) -> tuple[Array, Array]:
        layout, n, k = self._layout, self._layout.n_link, len(self._layout.positions)
        sigma = self._density * np.sqrt(h)
        position = sigma[:k] * h / np.sqrt(12.0) if self._integrated else np.full(k, self._position * np.sqrt(h))
        if extra is not None:
            sigma = np.sqrt(sigma**2 + extra**2)
        r = len(sigma)
        W, W_inverse = np.eye(r), np.eye(r)
        if self._integrated:
            M = self._mass_matrix(x[layout.q_link])
            W[:n, :n] = M / self._alone[:, None]
            W_inverse[:n, :n] = np.linalg.inv(W[:n, :n])
        T, G = np.zeros((r + k, r + k)), np.zeros((r + k, r + k))
        rates, positions = layout.rates, layout.positions
        by_position = W[:k, :k] / position[:, None]
        T[:r, rates], T[r:, positions] = W / sigma[:, None], by_position
        G[rates, :r], G[positions, r:] = W_inverse * sigma, W_inverse[:k, :k] * position
        if self._integrated:
            T[r:, rates[:k]] = -0.5 * h * by_position
            G[positions, :r] = 0.5 * h * G[rates[:k], :r]
        return T, G

    def _mass_matrix(self, q: Array) -> Array:
        return self._tree.mass_matrix(q[None])[0]
