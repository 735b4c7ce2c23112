# SPDX-License-Identifier: BSD-3-Clause
"""A sensor sample between two ticks: the sensor's own factor at the interpolated state.

White noise on the velocities makes the cubic Hermite polynomial the most likely motion between two ticks:

    q(t) = h00 q0 + h h10 v0 + h01 q1 + h h11 v1,   v(t) = dq/dt

Variables: X(k), X(k+1) and those of the sensor. A measurement is never moved in time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.factor import Factor, Linearization, Samples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InterpolatedFactor:
    """A factor on one state, moved to the times of its samples.

    Attributes:
        inner: factor of the sensor.
        fraction: (t - t_k) / h of each sample, in [0, 1], shape (m,).
        h: distance of the two ticks, shape (m,) [s].
    """

    inner: Factor
    fraction: Array
    h: Array

    states = 2

    def __len__(self) -> int:
        return len(self.inner)

    @property
    def name(self) -> str:
        """Name of the sensor."""
        return self.inner.name

    @property
    def rows(self) -> tuple[str, ...]:
        """Rows of the sensor."""
        return self.inner.rows

    @property
    def blocks(self) -> tuple[str, ...]:
        """Blocks of the sensor."""
        return self.inner.blocks

    @property
    def sigmas(self) -> Array:
        """Noise of the sensor."""
        return self.inner.sigmas

    def select(self, samples: Samples) -> InterpolatedFactor:
        """The same factor for some of the samples."""
        return replace(self, inner=self.inner.select(samples), fraction=self.fraction[samples], h=self.h[samples])

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Residual of the sensor at the interpolated state."""
        return self.inner.residual((interpolate(x[0], x[1], self.fraction, self.h),), calibration)

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives by both states."""
        inner = self.inner.linearize((interpolate(x[0], x[1], self.fraction, self.h),), calibration)
        J = inner.by_state[0]
        J0, J1 = np.empty_like(J), np.empty_like(J)
        position, velocity = ([w[:, None, None] for w in part] for part in _weights(self.fraction, self.h))
        for q, v in _position_velocity_columns(J.shape[2]):
            J0[:, :, q] = position[0] * J[:, :, q] + velocity[0] * J[:, :, v]
            J0[:, :, v] = position[1] * J[:, :, q] + velocity[1] * J[:, :, v]
            J1[:, :, q] = position[2] * J[:, :, q] + velocity[2] * J[:, :, v]
            J1[:, :, v] = position[3] * J[:, :, q] + velocity[3] * J[:, :, v]
        return Linearization(inner.residual, (J0, J1), inner.by_block)


def interpolate(x0: Array, x1: Array, fraction: Array, h: Array) -> Array:
    """States between two ticks.

    Args:
        x0: states at the first tick, shape (m, 4n).
        x1: states at the second tick, shape (m, 4n).
        fraction: (t - t_k) / h, in [0, 1], shape (m,).
        h: distance of the ticks, shape (m,) [s].

    Returns:
        Shape (m, 4n).
    """
    x = np.empty_like(x0)
    weights = _weights(fraction, h)
    for q, v in _position_velocity_columns(x0.shape[1]):
        pairs = (x0[:, q], x0[:, v], x1[:, q], x1[:, v])
        x[:, q] = sum(w[:, None] * part for w, part in zip(weights[0], pairs, strict=True))
        x[:, v] = sum(w[:, None] * part for w, part in zip(weights[1], pairs, strict=True))
    return x


def _weights(s: Array, h: Array) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Weights of (q0, v0, q1, v1) in the position and in the velocity, shape (m,) each."""
    position = ((1 + 2 * s) * (1 - s) ** 2, h * s * (1 - s) ** 2, s**2 * (3 - 2 * s), h * s**2 * (s - 1))
    slope = 6 * s * (s - 1) / h
    velocity = (slope, (1 - s) * (1 - 3 * s), -slope, s * (3 * s - 2))
    return position, velocity


def _position_velocity_columns(size: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Columns of positions and velocities in a state, for the link and for the motor side."""
    n = size // 4
    return (slice(0, n), slice(n, 2 * n)), (slice(2 * n, 3 * n), slice(3 * n, 4 * n))
