# SPDX-License-Identifier: BSD-3-Clause
"""Process noise of one step at one state: the whitening of the defects of the dynamics factor, and its inverse.

The rows and sigmas of `factors.step`: velocity defects d_v and position defects, link rows turned into impulses by
W = M(q) / (inertia alone), with standard deviations s sqrt(h) and s h sqrt(h/12).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from jointscope.factors.step import position_sigmas, rate_sigmas
from jointscope.graphs.problem.bag_problem import INTEGRATORS
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

SAME_POSITION = 0.02  # [rad] inertia weighs the noise; within this it does so as before, to two percent


class StepNoise:
    """Noise of the steps of one robot.

    Args:
        robot: its noise and layout.
    """

    def __init__(self, robot: Robot):
        self._layout, noise = robot.layout, robot.noise
        self._behind = INTEGRATORS[robot.choices.integrator].behind
        self._process, self._integrated = noise, noise.model == "integrated"
        # the bodies of the URDF, as where the noise was estimated; effects on inertia do not enter the weights
        self._tree = robot.kinematic_tree
        self._alone = self._tree.free_inertias()
        r, k = len(robot.layout.rates), len(robot.layout.positions)
        self._rate_rows, self._position_rows = np.arange(r), np.arange(r, r + k)
        self._eye = np.eye(robot.layout.n_link)
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
        layout, k = self._layout, len(self._layout.positions)
        length = np.array([h])
        sigma = rate_sigmas(self._process, length)
        position = position_sigmas(self._process, sigma[:k], length)
        if extra is not None:
            sigma = np.sqrt(sigma**2 + extra**2)
        T, G = np.zeros((2, layout.size, layout.size))
        # as if every coordinate were alone; of the links only where inertia does not weigh
        T[self._rate_rows, layout.rates], G[layout.rates, self._rate_rows] = 1.0 / sigma, sigma
        T[self._position_rows, layout.positions], G[layout.positions, self._position_rows] = 1.0 / position, position
        if not self._integrated:
            return T, G
        lag, moved = 0.5 * self._behind * h, layout.velocities
        T[self._position_rows, moved], G[layout.positions, self._rate_rows[:k]] = -lag / position, lag * sigma[:k]
        n, q, v = layout.n_link, layout.q_link, layout.v_link
        W = self._tree.weighing_inertia(x[None, q])[0] / self._alone[:, None]
        W_inverse = lapack.dgesv(W, self._eye)[2]
        rates, positions = slice(0, n), slice(len(sigma), len(sigma) + n)
        by_position = W / position[:n, None]
        T[rates, v], T[positions, q], T[positions, v] = W / sigma[:n, None], by_position, -lag * by_position
        by_rate = W_inverse * sigma[:n]
        G[v, rates], G[q, rates], G[q, positions] = by_rate, lag * by_rate, W_inverse * position[:n]
        return T, G
