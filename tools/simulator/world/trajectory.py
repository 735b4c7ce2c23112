# SPDX-License-Identifier: BSD-3-Clause
"""What the engine did, on its fine grid, and at any time between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Positions and velocities of all coordinates of the engine at equal steps from time zero.

    Attributes:
        step: of the grid [s].
        q: positions, shape (m, nq) [rad].
        v: velocities, shape (m, nq) [rad/s].
        u: command that acted in the step before each point, shape (m, n); None where nobody asks for it.
    """

    step: float
    q: Array
    v: Array
    u: Array | None = None

    @property
    def end(self) -> float:
        """Last time of the grid [s]."""
        return self.step * (len(self.q) - 1)

    def at(self, times: Array) -> tuple[Array, Array]:
        """Positions and velocities at any times, from the cubic through positions and velocities of two grid points.

        Times outside the grid get its ends; on a grid point the result is that point exactly.

        Args:
            times: shape (k,) [s].

        Returns:
            Positions and velocities, each of shape (k, nq) [rad], [rad/s].
        """
        place = np.clip(np.asarray(times) / self.step, 0.0, len(self.q) - 1.0)
        nearest = np.rint(place)
        # A stamp such as 0.3 is not a multiple of the step in floating point; within a picosecond it is meant.
        place = np.where(np.abs(place - nearest) * self.step < 1e-12, nearest, place)
        i = np.minimum(place.astype(int), len(self.q) - 2)
        s = (place - i)[:, None]
        q0, q1, h = self.q[i], self.q[i + 1], self.step
        m0, m1 = h * self.v[i], h * self.v[i + 1]
        rise = q1 - q0
        c2, c3 = 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise
        q = q0 + s * (m0 + s * (c2 + s * c3))
        v = (m0 + s * (2.0 * c2 + 3.0 * s * c3)) / h
        on_grid = place == nearest
        q[on_grid], v[on_grid] = self.q[place[on_grid].astype(int)], self.v[place[on_grid].astype(int)]
        return q, v

    def command(self, times: Array) -> Array:
        """The command that acted until each time, shape (k, n); of a time before the first step that of the first."""
        assert self.u is not None
        place = np.clip(np.ceil(np.asarray(times) / self.step - 1e-6).astype(int), 1, len(self.u) - 1)
        return self.u[place]

    def acceleration(self, times: Array) -> Array:
        """Accelerations of all coordinates, shape (k, nq) [rad/s^2]: differences of velocities, linear in between.

        A time on or after the last point gets the difference of the last two: what comes is not known yet.
        """
        if len(self.v) < 2:
            return np.zeros((len(times), self.v.shape[1]))
        place = np.clip(np.asarray(times) / self.step, 0.0, len(self.q) - 1.0)
        slope = (self.v[1:] - self.v[:-1]) / self.step  # at the middles between the points
        left = np.clip(np.floor(place - 0.5 + 1e-9).astype(int), 0, len(slope) - 1)
        right = np.minimum(left + 1, len(slope) - 1)
        s = np.clip(place - 0.5 - left, 0.0, 1.0)[:, None]
        return (1.0 - s) * slope[left] + s * slope[right]
