# SPDX-License-Identifier: BSD-3-Clause
"""A sensor sample between two ticks: the sensor's own factor at the interpolated state.

White noise on the velocities makes the cubic Hermite polynomial the most likely motion between two ticks:

    q(t) = h00 q0 + h h10 v0 + h01 q1 + h h11 v1,   v(t) = dq/dt

Variables: X(k), X(k+1) and those of the sensor; dynamics where effects make the stamps late or the readings smooth. A
measurement is never moved in time; where its lateness is a parameter, the state is taken at another fraction of the
step. Where a filter has smoothed it, positions are those of the state plus variance/2 times the mean acceleration of
the step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.factor import Factor, Linearization, Samples
from jointscope.factors.seen_through import SeenThrough
from jointscope.robots.model.lateness import Lateness
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InterpolatedFactor(SeenThrough[Factor]):
    """A factor on one state, moved to the times of its samples.

    Attributes:
        fraction: (t - t_k) / h of each sample, shape (m,); outside [0, 1] the polynomial goes on.
        h: distance of the two ticks, shape (m,) [s].
        layout: of the states.
        late: how late the stamps are beyond `fraction`, and how smooth the readings; None if they are right.
        fixed: parameters that calibration leaves alone, by full name.
    """

    fraction: Array
    h: Array
    layout: StateLayout
    late: Lateness | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)

    @property
    def states(self) -> int:
        """Two: the ticks on both sides."""
        return 2

    @property
    def blocks(self) -> tuple[str, ...]:
        """Blocks of the sensor, and dynamics where the stamps are late."""
        inner = self.inner.blocks
        return inner if self.late is None or DYNAMICS in inner else (*inner, DYNAMICS)

    def select(self, samples: Samples) -> Self:
        """The same factor for some of the samples."""
        late = self.late
        if late is not None:
            late = replace(late, stamps=late.stamps[samples], anchor=late.anchor[samples])
        return replace(super().select(samples), fraction=self.fraction[samples], h=self.h[samples], late=late)

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Residual of the sensor at the interpolated state."""
        fraction, _ = self._fraction(calibration)
        between = self._smoothed(self.between(x[0], x[1], fraction, calibration), x, calibration)
        return self.inner.residual((between,), calibration)

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives by both states, and by what makes the stamps late."""
        fraction, slopes = self._fraction(calibration)
        between = self._smoothed(self.between(x[0], x[1], fraction, calibration), x, calibration)
        inner = self.inner.linearize((between,), calibration)
        J = inner.by_state[0]
        by_block, by_ends = dict(inner.by_block), self.by_ends(J, fraction)
        if slopes:
            rate = (J @ self.motion(x[0], x[1], fraction, calibration)[:, :, None])[:, :, 0]
            by_block[DYNAMICS] = self._by_parameters(-rate, slopes, by_block, calibration)
        for name, column in self.behind(J, fraction, calibration).items():
            by_block[DYNAMICS] = self._by_parameters(column, {name: 1.0}, by_block, calibration)
        variance, smooth = self._variance(calibration)
        if smooth:
            q, v = self.layout.positions, self.layout.velocities
            bend = 0.5 * (J[:, :, q] @ ((x[1] - x[0])[:, v] / self.h[:, None])[:, :, None])[:, :, 0]
            by_block[DYNAMICS] = self._by_parameters(bend, smooth, by_block, calibration)
            by_velocity = 0.5 * variance * J[:, :, q] / self.h[:, None, None]
            by_ends[0][:, :, v] -= by_velocity
            by_ends[1][:, :, v] += by_velocity
        return Linearization(inner.residual, by_ends, by_block)

    def between(self, x0: Array, x1: Array, fraction: Array, calibration: Calibration) -> Array:
        """What the factor of the sensor takes as its state, shape (m, d)."""
        return interpolate(self.layout, x0, x1, fraction, self.h)

    def motion(self, x0: Array, x1: Array, fraction: Array, calibration: Calibration) -> Array:
        """Time derivative of `between`."""
        return rate_between(self.layout, x0, x1, fraction, self.h)

    def behind(self, J: Array, fraction: Array, calibration: Calibration) -> dict[str, Array]:
        """Derivatives by parameters that what stands behind the state depends on, by full name, shape (m, r) each."""
        return {}

    def by_ends(self, J: Array, fraction: Array) -> tuple[Array, Array]:
        """Derivatives by both ends of something with derivative J by the state between them, shape (m, r, d)."""
        J0, J1, s = np.empty_like(J), np.empty_like(J), fraction[:, None, None]
        position, velocity = ([w[:, None, None] for w in part] for part in weights_between(fraction, self.h))
        q, v, z = self.layout.positions, self.layout.velocities, self.layout.memory
        J0[:, :, q] = position[0] * J[:, :, q] + velocity[0] * J[:, :, v]
        J0[:, :, v] = position[1] * J[:, :, q] + velocity[1] * J[:, :, v]
        J1[:, :, q] = position[2] * J[:, :, q] + velocity[2] * J[:, :, v]
        J1[:, :, v] = position[3] * J[:, :, q] + velocity[3] * J[:, :, v]
        J0[:, :, z], J1[:, :, z] = (1.0 - s) * J[:, :, z], s * J[:, :, z]
        return J0, J1

    def _smoothed(self, between: Array, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """States with positions as a filter shows them; in place."""
        variance, smooth = self._variance(calibration)
        return smoothed(self.layout, between, x[0], x[1], self.h, variance) if smooth else between

    def _variance(self, calibration: Calibration) -> tuple[float, dict[str, float]]:
        """Of the weights of filters [s^2], and its slopes."""
        return (0.0, {}) if self.late is None else self.late.variance(self._named(calibration))

    def _named(self, calibration: Calibration) -> dict[str, float]:
        return {**self.fixed, **calibration.by_name}

    def _by_parameters(
        self,
        change: Array,
        slopes: Mapping[str, Array | float],
        by_block: dict[str, Array],
        calibration: Calibration,
    ) -> Array:
        """Derivative by the dynamics; `change` is that of the reading by lateness or variance, shape (m, r)."""
        total = np.zeros((*change.shape, len(calibration.names)))
        if DYNAMICS in by_block:
            total += by_block[DYNAMICS]
        for name, slope in slopes.items():
            if name in calibration.names:
                k = calibration.names.index(name)
                total[:, :, k] += (change.T * slope).T * calibration.value_by_coordinate[k]
        return total

    def _fraction(self, calibration: Calibration) -> tuple[Array, dict[str, Array]]:
        """Fraction of the step at which each sample was taken, and the slopes of its lateness."""
        if self.late is None:
            return self.fraction, {}
        late, slopes = self.late.since_anchor(self._named(calibration))
        return self.fraction - late / self.h, slopes


def interpolate(layout: StateLayout, x0: Array, x1: Array, fraction: Array, h: Array) -> Array:
    """States between two ticks.

    Args:
        layout: of the states.
        x0: states at the first tick, shape (m, d).
        x1: states at the second tick, shape (m, d).
        fraction: (t - t_k) / h, shape (m,).
        h: distance of the ticks, shape (m,) [s].

    Returns:
        Shape (m, d); positions and velocities by the cubic polynomial, memories linearly.
    """
    x = np.empty_like(x0)
    q, v, z = layout.positions, layout.velocities, layout.memory
    weights = weights_between(fraction, h)
    pairs = (x0[:, q], x0[:, v], x1[:, q], x1[:, v])
    x[:, q] = sum(w[:, None] * part for w, part in zip(weights[0], pairs, strict=True))
    x[:, v] = sum(w[:, None] * part for w, part in zip(weights[1], pairs, strict=True))
    x[:, z] = x0[:, z] + fraction[:, None] * (x1[:, z] - x0[:, z])
    return x


def smoothed(layout: StateLayout, between: Array, x0: Array, x1: Array, h: Array, variance: float | Array) -> Array:
    """States between two ticks with positions as a filter with weights of this variance [s^2] shows them; in place.

    The mean acceleration of the step stands for the one at the sample's time: it is less at the mercy of noise, and
    the difference is a little lateness more.
    """
    q, v = layout.positions, layout.velocities
    between[:, q] += 0.5 * np.reshape(variance / h, (-1, 1)) * (x1 - x0)[:, v]
    return between


def rate_between(layout: StateLayout, x0: Array, x1: Array, fraction: Array, h: Array) -> Array:
    """Time derivative of `interpolate`, shape (m, d)."""
    rate = np.empty_like(x0)
    q, v, z = layout.positions, layout.velocities, layout.memory
    s = fraction
    pairs = (x0[:, q], x0[:, v], x1[:, q], x1[:, v])
    curvature = ((12 * s - 6) / h**2, (6 * s - 4) / h, -(12 * s - 6) / h**2, (6 * s - 2) / h)
    rate[:, q] = sum(w[:, None] * part for w, part in zip(weights_between(s, h)[1], pairs, strict=True))
    rate[:, v] = sum(w[:, None] * part for w, part in zip(curvature, pairs, strict=True))
    rate[:, z] = (x1[:, z] - x0[:, z]) / h[:, None]
    return rate


def weights_between(s: Array, h: Array) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Weights of (q0, v0, q1, v1) in the position and in the velocity, shape (m,) each."""
    position = ((1 + 2 * s) * (1 - s) ** 2, h * s * (1 - s) ** 2, s**2 * (3 - 2 * s), h * s**2 * (s - 1))
    slope = 6 * s * (s - 1) / h
    velocity = (slope, (1 - s) * (1 - 3 * s), -slope, s * (3 * s - 2))
    return position, velocity
