# SPDX-License-Identifier: BSD-3-Clause
"""Rests linearised at a solution, friction bands as sharp as they are: the fall of the cost by some values together.

    cost(d) = d' A d / 2 + b' d + sum of the bands' costs at  y + Y d,  half + H d  - sum of n_j log(1 + G_j d)

A shift of a band pays only together with a narrower one, and by far more than a score at the solution says: a step as
long as the edges are wide is nothing. So values are moved to the minimum of this model, which needs no equations of
motion. States are eliminated; what they are uncertain by adds to the noise of y. The last sum is of the n_j commands
of each motor, whose gain grows by G_j d of itself: of gain, band and weights together only ratios show in commands.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.friction_band import band_cost
from jointscope.graphs.rest_sets.rest_set import EDGE, RestSet

Array = NDArray[np.float64]
Columns = NDArray[np.intp]
EDGES = (1.0, 0.3, 0.1, 0.04, EDGE)  # of the friction: blur of the bands' edges, stage by stage
MOST_STEPS, MOST_TRIES = 12, 12  # in a stage, and of the damping in a step
GAINED = 1e-3  # of the cost, that ends a stage


@dataclass(frozen=True)
class LinearRests:
    """The linear model; p shared values, M bands that say something.

    Attributes:
        A, b: shape (p, p) and (p,), priors included.
        y, half, Y, H: shape (M,) and (M, p) [N m].
        sigma, scale: of the M bands, noise without the blur of the edges, and what this is relative to [N m].
        before: as of `RestBands`, shape (M,) [N m].
        motor: number of the motor of each band, shape (M,).
        counts: bands of each of the n motors, shape (n,).
        G: slopes of the logarithm of each motor's gain, shape (n, p).
    """

    A: Array
    b: Array
    y: Array
    half: Array
    Y: Array
    H: Array
    sigma: Array
    scale: Array
    before: Array
    motor: Columns
    counts: Array
    G: Array

    @staticmethod
    def of(problem: RestSet, x: Array, calibration: Calibration, weight: Array, pull: Array) -> LinearRests:
        """Linearises.

        Args:
            problem: the rests.
            x: states at the solution, shape (m, d).
            calibration: values there.
            weight: information of the priors, shape (p,).
            pull: their gradient, shape (p,).
        """
        torques = problem.torques(x, calibration)
        r, J, P = problem.equations(x, torques, calibration)
        bands = replace(problem, edge=0.0).bands(x, torques, calibration)
        transposed = np.swapaxes(J, 1, 2)
        cross = transposed @ P
        covariance = np.linalg.inv(transposed @ J)
        x_by, moved = -covariance @ cross, -(covariance @ (transposed @ r[:, :, None]))
        rows = P.reshape(-1, P.shape[2])
        A = rows.T @ rows + np.einsum("mdp,mdq->pq", cross, x_by) + np.diag(weight)
        b = rows.T @ r.reshape(-1) + np.einsum("mdp,md->p", cross, moved[:, :, 0]) + pull
        kept, counts = bands.counts > 0.0, bands.counts.sum(axis=0)
        (by_x, by_p), (half_by_x, half_by_p) = bands.y_slopes, bands.half_slopes
        y, Y = bands.y + (by_x @ moved)[:, :, 0], by_p + by_x @ x_by
        half, H = bands.half + (half_by_x @ moved)[:, :, 0], half_by_p + half_by_x @ x_by
        noise = np.hypot(bands.sigma, np.sqrt(np.einsum("mnd,mde,mne->mn", by_x, covariance, by_x)))
        scale = np.broadcast_to(problem.friction_scale, y.shape)
        half = np.maximum(half, 1e-3 * scale)
        y, half, Y, H, noise, scale, before = (p[kept] for p in (y, half, Y, H, noise, scale, bands.before))
        G = bands.log_gain_slopes
        motor = np.nonzero(kept)[1]
        return LinearRests(0.5 * (A + A.T), b, y, half, Y, H, noise, scale, before, motor, counts, G)

    def moved(self, d: Array) -> LinearRests:
        """The same about values that are d further, shape (p,)."""
        return replace(
            self,
            b=self.b + self.A @ d,
            y=self.y + self.Y @ d,
            half=self.half + self.H @ d,
            G=self.G / (1.0 + self.G @ d)[:, None],
        )

    def per_value(self, size: Array) -> LinearRests:
        """The same by values of which each coordinate has `size`, shape (p,)."""
        return replace(
            self, A=self.A / np.outer(size, size), b=self.b / size, Y=self.Y / size, H=self.H / size, G=self.G / size
        )

    def of_columns(self, columns: Columns) -> LinearRests:
        """Some of the values alone, the others held; columns of shape (k,)."""
        return replace(
            self,
            A=self.A[np.ix_(columns, columns)],
            b=self.b[columns],
            Y=self.Y[:, columns],
            H=self.H[:, columns],
            G=self.G[:, columns],
        )

    def minimum(self, columns: Columns) -> tuple[Array, float]:
        """Values and cost where it is smallest, the values of other columns held.

        Args:
            columns: of the values that move, shape (k,).
        """
        part = self.of_columns(columns)
        d, cost = np.zeros(len(columns)), float("inf")
        for edge in EDGES:
            d, cost = part._descended(d, np.hypot(edge * self.scale, self.sigma))
        return d, cost

    def _descended(self, d: Array, sigma: Array) -> tuple[Array, float]:
        damping, cost = 1e-3, self._cost(d, sigma)
        for _ in range(MOST_STEPS):
            g, H = self._slopes(d, sigma)
            before = cost
            for _ in range(MOST_TRIES):
                step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
                there = self._cost(d + step, sigma)
                if there < cost:
                    d, cost, damping = d + step, there, damping * 0.2
                    break
                damping = max(damping, 1e-6) * 5.0
            if before - cost < GAINED:
                break
        return d, cost

    def _cost(self, d: Array, sigma: Array) -> float:
        half, gain = self.half + self.H @ d, 1.0 + self.G @ d
        if np.any(half <= 0.0) or np.any(gain <= 0.0):
            return float("inf")
        bands = band_cost(self.y + self.Y @ d, half, sigma).cost
        return float(0.5 * d @ self.A @ d + self.b @ d + bands.sum() - self.counts @ np.log(gain))

    def _slopes(self, d: Array, sigma: Array) -> tuple[Array, Array]:
        """Gradient, and the second derivatives without those of log(half), which are negative."""
        y, half = self.y + self.Y @ d, self.half + self.H @ d
        found = band_cost(y, half, sigma)
        G = self.G / (1.0 + self.G @ d)[:, None]
        g = self.A @ d + self.b + self.Y.T @ found.by_torque + self.H.T @ found.by_half - G.T @ self.counts
        yy, yh, hh = found.curvature
        Y, H = self.Y, self.H
        mixed = Y.T @ (yh[:, None] * H)
        A = self.A + (G.T * self.counts) @ G
        return g, A + Y.T @ (yy[:, None] * Y) + H.T @ (hh[:, None] * H) + mixed + mixed.T
