# SPDX-License-Identifier: BSD-3-Clause
"""A sample that depends on what drives the motors: a factor on the state and the command that acts.

Variables: X(k), X(k+1) and those of the sensor; dynamics where effects change the command or make the stamps late. A
command is constant over a step, so a sample at a tick sees the one that has acted until then. Where the drive signal
was measured it runs on within the step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.factor import Samples
from jointscope.factors.interpolated import InterpolatedFactor
from jointscope.robots.dynamics.command_path import CommandPath

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class DrivenFactor(InterpolatedFactor):
    """A factor on a state with the acting command behind it, (x, u), at the times of its samples.

    Attributes:
        path: commands of the recording and what effects make of them.
        step: in which each sample was taken, shape (m,).
    """

    path: CommandPath
    step: NDArray[np.intp]

    def select(self, samples: Samples) -> Self:
        """The same factor for some of the samples."""
        return replace(super().select(samples), step=self.step[samples])

    def between(self, x0: Array, x1: Array, fraction: Array, calibration: Calibration) -> Array:
        """State and acting command, shape (m, d + n)."""
        u, _ = self.path.acting(self._named(calibration))
        return np.hstack([super().between(x0, x1, fraction, calibration), self._within(u, fraction)])

    def motion(self, x0: Array, x1: Array, fraction: Array, calibration: Calibration) -> Array:
        """Time derivative of `between`; a command jumps between steps and is constant in them."""
        rate = np.zeros((len(x0), self.path.n))
        if self.path.runs_on:
            rate = self.path.rises(self.path.acting(self._named(calibration))[0])[self.step] / self.h[:, None]
        return np.hstack([super().motion(x0, x1, fraction, calibration), rate])

    def by_ends(self, J: Array, fraction: Array) -> tuple[Array, Array]:
        """Derivatives by both ends; J is one by (x, u), shape (m, r, d + n)."""
        return super().by_ends(J[:, :, : self.layout.size], fraction)

    def behind(self, J: Array, fraction: Array, calibration: Calibration) -> dict[str, Array]:
        """Derivatives by the parameters of effects on the commands, by full name, shape (m, r) each."""
        _, slopes = self.path.acting(self._named(calibration))
        by_u = J[:, :, self.layout.size :]
        return {name: (by_u @ self._within(slope, fraction)[:, :, None])[:, :, 0] for name, slope in slopes.items()}

    @property
    def blocks(self) -> tuple[str, ...]:
        """Blocks of the sensor, and dynamics."""
        return self.inner.blocks if DYNAMICS in self.inner.blocks else (*self.inner.blocks, DYNAMICS)

    def _within(self, of_steps: Array, fraction: Array) -> Array:
        """A signal with these means over the steps, or its derivative, at the samples, shape (m, n)."""
        here = of_steps[self.step]
        if not self.path.runs_on:
            return here
        return np.asarray(here + (fraction - 0.5)[:, None] * self.path.rises(of_steps)[self.step])
