# SPDX-License-Identifier: BSD-3-Clause
"""The matrix between motors and links from a recording with locked springs alone: values, sigmas, and what is zero.

Total least squares (rigid_rows.py) over the rows of A = T^-1 that locked springs show: there an element is a pulley
that a rope passes, so what is no pulley is zero. Elements below ZERO_SIGMAS are held at zero, one after the other, the
weakest first. No ratio is taken to be an integer. Residuals that repeat widen the sigmas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.locked_springs.locked_readings import LockedReadings
from jointscope.graphs.locked_springs.rigid_rows import RigidRows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ROUNDS, SETTLED = 30, 1e-3  # Gauss-Newton steps, and the size of one that ends them [sigma]
WIDENINGS = 3  # passes of sigmas and what residuals repeat
ZERO_SIGMAS = 4.0  # below which an element is zero
LAGS = 0.1  # of the instants, over which residuals may repeat


@dataclass(frozen=True)
class CouplingFit:
    """Rows of A from locked readings of one or more recordings.

    Attributes:
        readings: of each recording.
        A: rows of the locked joints, shape (k, n) [rad/rad].
        free: elements that were looked for, shape (k, n); the others are held.
        zeros, delays: of each recording, shape (k,) [rad] each, and [s].
        covariance: of the free elements row by row, then zeros and delay of each recording, shape (p, p).
        widened: D of rigid_rows.py, shape (k,).
        rms: residual of each locked joint, shape (k,) [rad].
        explained: what its encoders explain, shape (k,) [rad].
        cost: at the end.
        converged: whether the last step was small.
    """

    readings: tuple[LockedReadings, ...]
    A: Array
    free: Mask
    zeros: tuple[Array, ...]
    delays: tuple[float, ...]
    covariance: Array
    widened: Array
    rms: Array
    explained: Array
    cost: float
    converged: bool

    @property
    def sigmas(self) -> Array:
        """Of the elements, shape (k, n); zero where they are held."""
        found = np.zeros_like(self.A)
        found[self.free] = np.sqrt(np.diag(self.covariance))[: int(self.free.sum())]
        return found

    def rows(self, i: int) -> RigidRows:
        """Residuals of a recording."""
        return _rows(self.readings[i], self.A, self.zeros[i], self.delays[i], self.widened)

    def residuals(self) -> Array:
        """Of all recordings, shape (m, k) [rad]."""
        return np.vstack([self.rows(i).r for i in range(len(self.readings))])


def fit_coupling(readings: Sequence[LockedReadings], stated: Array) -> CouplingFit:
    """Rows of A, with elements that are not significant at zero.

    Args:
        readings: of recordings in which the springs of the same joints are locked.
        stated: rows of A that the robot file has, shape (k, n); columns of joints that stand keep its values.
    """
    still = np.all([r.still for r in readings], axis=0)
    free = np.broadcast_to(~still, stated.shape).copy()
    fit = _widened(readings, stated, free)
    own = np.zeros_like(free)
    own[np.arange(len(stated)), readings[0].rows] = True
    while True:
        sizes = np.abs(fit.A) / np.where(fit.free, np.maximum(fit.sigmas, 1e-300), np.inf)
        weak = fit.free & ~own & (sizes < ZERO_SIGMAS)
        if not weak.any():
            return fit
        # one at a time, the least significant first: others become sharper by it
        place = np.unravel_index(int(np.argmin(np.where(weak, sizes, np.inf))), sizes.shape)
        free = fit.free.copy()
        free[place] = False
        A = fit.A.copy()
        A[place] = 0.0
        fit = _fitted(readings, A, free, fit.widened, fit)


def _widened(readings: Sequence[LockedReadings], stated: Array, free: Mask) -> CouplingFit:
    """A fit whose sigmas say what its residuals repeat."""
    fit = _fitted(readings, _regressed(readings, stated, free), free, np.ones(len(stated)), None)
    for _ in range(WIDENINGS):
        widened = fit.widened * _repeats(fit)
        widened = np.maximum(widened, 1.0)
        if np.allclose(widened, fit.widened, rtol=0.02):
            break
        fit = _fitted(readings, fit.A, free, widened, fit)
    return fit


def _regressed(readings: Sequence[LockedReadings], stated: Array, free: Mask) -> Array:
    """Rows of A by regression: far off the matrix, total least squares may lead away from it."""
    motors = np.vstack([r.q_motor - r.q_motor.mean(axis=0) for r in readings])
    links = np.vstack([r.q_link - r.q_link.mean(axis=0) for r in readings])
    A = np.array(stated, dtype=np.float64)
    for k, own in enumerate(free):
        left = motors[:, k] - links[:, ~own] @ A[k, ~own]
        A[k, own] = np.linalg.lstsq(links[:, own], left, rcond=None)[0]
    return A


def _repeats(fit: CouplingFit) -> Array:
    """Root of the size of whitened residuals, times how many in a row are alike, for each locked joint, shape (k,)."""
    found = []
    for i in range(len(fit.readings)):
        rows = fit.rows(i)
        e = rows.r / np.sqrt(np.diag(rows.S))
        m = len(e)
        longest = max(2, int(LAGS * m))
        c = np.array([np.sum(e[lag:] * e[: m - lag], axis=0) for lag in range(longest)]) / np.sum(e**2, axis=0)
        ends = np.argmax(np.vstack([c, np.full((1, e.shape[1]), -1.0)]) <= 0.0, axis=0)  # first that is not positive
        alike = np.array([1.0 + 2.0 * c[1:end, j].sum() for j, end in enumerate(ends.tolist())])
        found.append(np.mean(e**2, axis=0) * np.maximum(alike, 1.0))
    return np.sqrt(np.mean(found, axis=0))


def _fitted(
    readings: Sequence[LockedReadings], A: Array, free: Mask, widened: Array, near: CouplingFit | None
) -> CouplingFit:
    """Gauss-Newton from a matrix, for elements that are free."""
    k, A = len(A), A.copy()
    zeros = [np.median(r.q_motor - r.q_link @ A.T, axis=0) for r in readings] if near is None else list(near.zeros)
    delays = [0.0] * len(readings) if near is None else list(near.delays)
    count = int(free.sum())
    p = count + len(readings) * (k + 1)
    converged = False
    for _ in range(ROUNDS):
        H, g, cost = np.zeros((p, p)), np.zeros(p), 0.0
        parts = [_rows(*each, widened) for each in zip(readings, [A] * len(readings), zeros, delays, strict=True)]
        for i, rows in enumerate(parts):
            own = slice(count + i * (k + 1), count + (i + 1) * (k + 1))
            H_i, g_i = rows.system(_derivatives(rows, free))
            index = np.concatenate([np.arange(count), np.arange(own.start, own.stop)])
            H[np.ix_(index, index)] += H_i
            g[index] += g_i
            cost += rows.cost
        if not np.all(np.isfinite(H)):
            covariance = np.full_like(H, np.nan)
            break
        scale = 1.0 / np.sqrt(np.diag(H))
        covariance = np.linalg.pinv(H * np.outer(scale, scale), hermitian=True) * np.outer(scale, scale)
        step = -covariance @ g
        A[free] += step[:count]
        for i in range(len(readings)):
            begin = count + i * (k + 1)
            zeros[i], delays[i] = zeros[i] + step[begin : begin + k], delays[i] + float(step[begin + k])
        converged = float(np.max(np.abs(step) / np.sqrt(np.maximum(np.diag(covariance), 1e-300)))) < SETTLED
        if converged:
            break
    residuals = np.vstack([rows.r for rows in parts])
    explained = np.sqrt(np.diag(parts[0].S)) / widened
    return CouplingFit(
        tuple(readings), A, free, tuple(zeros), tuple(delays), covariance, widened,
        np.sqrt(np.mean(residuals**2, axis=0)), explained, cost, converged,
    )  # fmt: skip


def _rows(readings: LockedReadings, A: Array, zero: Array, delay: float, widened: Array) -> RigidRows:
    sigmas = (readings.sigma_motor, readings.sigma_link)
    links = (readings.q_link, readings.v_link, readings.a_link)
    return RigidRows.of(readings.q_motor, links, sigmas, widened, A, zero, delay)


def _derivatives(rows: RigidRows, free: Mask) -> Array:
    """By free elements row by row, zeros and the delay, shape (m, k, p)."""
    m, k = rows.r.shape
    places = np.argwhere(free)
    J = np.zeros((m, k, len(places) + k + 1))
    for c, (row, column) in enumerate(places.tolist()):
        J[:, row, c] = -rows.q[:, row, column]
    J[:, np.arange(k), len(places) + np.arange(k)] = -1.0
    J[:, :, -1] = rows.turned
    return J
