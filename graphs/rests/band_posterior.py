# SPDX-License-Identifier: BSD-3-Clause
"""What rests say of friction, with sigmas that hold: the likelihood of a band falls off a cliff on one side only.

The largest of n torques lies within s / n below the edge s of the band, and no Gaussian at the most likely s says that:
it is too small, and what a quarter of a cliff's slope says of its width is no sigma. So mean and covariance are those
of the posterior itself. Each motor's bands tell of a few combinations of values; over these the posterior is sampled,

    p(z) = exp(-|z|^2 / 2 - c' z - sum of the bands' costs at  y + Y z,  half + H z),    z ~ N(0, 1) without the bands,

by walkers that move along lines to each other (Goodman and Weare, Ensemble samplers with affine invariance, 2010), and
its two moments stand in the joint Gaussian in place of the bands. Values above zero are taken as they are here, not as
logarithms: friction that may be zero has no logarithm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.friction_band import band_cost, likelihood_cost
from jointscope.graphs.rests.linear_rests import LinearRests
from jointscope.graphs.rests.rest_set import RestSet
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
TOLD = 0.25  # information, over that without bands, of a combination of which a motor's bands tell something
WALKERS, BURN_IN, ROUNDS = 64, 100, 300  # pairs of half-ensembles' moves before and while moments are taken
STRETCH = 2.0  # of a walker's move, as the source says
SEED = 1
SMALLEST_SHARE = 0.1  # of a positive value that its mean leaves of it


def band_posterior(problem: RestSet, robot: Robot, x: Array, calibration: Calibration) -> tuple[Calibration, Array]:
    """Mean and covariance of the values, friction bands integrated over.

    Args:
        problem: all rests with their weights.
        robot: with the priors.
        x: states of largest likelihood, shape (m, d).
        calibration: values there.

    Returns:
        Means as calibration, covariance of its coordinates, shape (p, p).
    """
    free = [robot.parameters[name] for name in calibration.names]
    prior = np.array([np.log(p.prior) if p.positive else p.prior for p in free])
    weight = np.array([1.0 / p.coordinate_sigma**2 for p in free])
    commands = replace(problem, per_command=True)  # what was recorded has the likelihood
    linear = LinearRests.of(commands, x, calibration, weight, weight * (calibration.dynamics - prior))
    values, size = calibration.values, calibration.value_by_coordinate
    friction = calibration.positive & np.any(linear.H != 0.0, axis=0)
    own = np.array([1.0 / p.prior_sigma**2 for p in free])
    pull = np.array([p.prior for p in free])
    A = (linear.A - np.diag(weight * friction)) / np.outer(size, size) + np.diag(own * friction)
    b = np.where(friction, linear.b - weight * (calibration.dynamics - prior), linear.b) / size
    b += friction * own * (values - pull)
    scaled = _Bands.of(linear, size, values, friction, problem.edge)
    mean, covariance = _moments(A, b, scaled)
    moved = np.where(calibration.positive, np.maximum(values + mean, SMALLEST_SHARE * values), values + mean)
    coordinates = np.where(calibration.positive, np.log(np.where(calibration.positive, moved, 1.0)), moved)
    found = calibration.with_points({DYNAMICS: coordinates})
    return found, covariance / np.outer(found.value_by_coordinate, found.value_by_coordinate)


@dataclass(frozen=True)
class _Bands:
    """Bands of all motors, linear in the values; arrays as of `LinearRests`.

    `least` says how far each value may fall, shape (p,).
    """

    y: Array
    half: Array
    Y: Array
    H: Array
    sigma: Array
    motor: NDArray[np.intp]
    least: Array

    @staticmethod
    def of(linear: LinearRests, size: Array, values: Array, friction: NDArray[np.bool_], edge: float) -> _Bands:
        least = np.where(friction, -values, -np.inf)
        sigma = np.hypot(edge * linear.scale, linear.sigma)
        return _Bands(linear.y, linear.half, linear.Y / size, linear.H / size, sigma, linear.motor, least)

    def of_motor(self, j: int) -> _Bands:
        own = self.motor == j
        parts = (part[own] for part in (self.y, self.half, self.Y, self.H, self.sigma, self.motor))
        return _Bands(*parts, self.least)

    def slopes(self) -> tuple[Array, Array, Array]:
        """Gradient, expected information and curvature."""
        found = band_cost(self.y, self.half, self.sigma)
        g = self.Y.T @ found.by_torque + self.H.T @ found.by_half
        yy, yh, hh = found.curvature
        mixed = self.Y.T @ (yh[:, None] * self.H)
        curved = self.Y.T @ (yy[:, None] * self.Y) + self.H.T @ (hh[:, None] * self.H) + mixed + mixed.T
        of_y, of_s = found.torque_information[:, None], found.half_information[:, None]
        return g, self.Y.T @ (of_y * self.Y) + self.H.T @ (of_s * self.H), curved


def _moments(A: Array, b: Array, bands: _Bands) -> tuple[Array, Array]:
    """Mean and covariance of the change of the values."""
    unit = 1.0 / np.sqrt(np.diag(A))
    L = unit[:, None] * np.linalg.inv(np.linalg.cholesky(A * np.outer(unit, unit))).T  # L L' = A^-1
    motors = [bands.of_motor(j) for j in np.unique(bands.motor).tolist()]
    slopes = [own.slopes() for own in motors]
    pulls = [L.T @ g for g, _, _ in slopes]
    c = L.T @ b
    P, h = np.eye(len(A)), -c
    for own, (_, information, curved), g in zip(motors, slopes, pulls, strict=True):
        told, vectors = np.linalg.eigh(L.T @ information @ L)
        V = vectors[:, told > TOLD]
        linear = V.T @ (c + np.sum(pulls, axis=0) - g)
        h -= g - V @ (V.T @ g)
        if not V.shape[1]:
            continue
        start = np.linalg.inv(np.eye(V.shape[1]) + V.T @ L.T @ curved @ L @ V)
        mean, covariance = _sampled(own, L @ V, linear, start)
        inverse = np.linalg.inv(covariance)
        P += V @ (inverse - np.eye(V.shape[1])) @ V.T
        h += V @ (inverse @ mean + linear)
    low, vectors = np.linalg.eigh(P)
    covariance = (vectors / np.maximum(low, 1e-3)) @ vectors.T
    return L @ covariance @ h, L @ covariance @ L.T


def _sampled(bands: _Bands, T: Array, c: Array, start: Array) -> tuple[Array, Array]:
    """Moments of the posterior over combinations z of the values T z.

    Args:
        bands: of one motor.
        T: shape (p, r).
        c: slope of the cost without bands, shape (r,).
        start: covariance of where the walkers begin, shape (r, r).
    """
    rng, r = np.random.default_rng(SEED), len(c)
    Y, H = bands.Y @ T, bands.H @ T
    bounded = np.isfinite(bands.least)

    def cost(point: Array) -> Array:
        z, at_edge = point[:, :r], point[:, r]
        half, found = bands.half + z @ H.T, np.full(len(z), np.inf)
        inside = np.all(half > 0.0, axis=1) & np.all(z @ T[bounded].T > bands.least[bounded], axis=1)
        inside &= (at_edge > 0.0) & (at_edge < 1.0)
        if inside.any():
            z = z[inside]
            found[inside] = 0.5 * np.log(at_edge[inside] * (1.0 - at_edge[inside]))  # the prior of Jeffreys for a share
            band = likelihood_cost(bands.y + z @ Y.T, half[inside], bands.sigma, at_edge[inside])
            found[inside] += band.sum(axis=1) + 0.5 * np.sum(z**2, axis=1) + z @ c
        return found

    walkers = np.column_stack([rng.normal(size=(WALKERS, r)) @ np.linalg.cholesky(start).T, rng.random(WALKERS)])
    costs = cost(walkers)
    while np.any(lost := ~np.isfinite(costs)):
        walkers[lost, :r] *= 0.7
        costs[lost] = cost(walkers[lost])
    halves = np.split(np.arange(WALKERS), 2)
    total, squares, count = np.zeros(r), np.zeros((r, r)), 0
    for k in range(BURN_IN + ROUNDS):
        for own, others in (halves, halves[::-1]):
            stretch = ((STRETCH - 1.0) * rng.random(len(own)) + 1.0) ** 2 / STRETCH
            other = walkers[rng.choice(others, len(own))]
            tried = other + stretch[:, None] * (walkers[own] - other)
            there = cost(tried)
            log_ratio = r * np.log(stretch) + costs[own] - there
            taken = np.log(rng.random(len(own))) < log_ratio
            walkers[own[taken]], costs[own[taken]] = tried[taken], there[taken]
        if k >= BURN_IN:
            z = walkers[:, :r]
            total, squares, count = total + z.sum(axis=0), squares + z.T @ z, count + WALKERS
    mean = total / count
    return mean, squares / count - np.outer(mean, mean)
