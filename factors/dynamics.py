# SPDX-License-Identifier: BSD-3-Clause
"""What the dynamics factors have in common, and the choice between them by the robot's integrator."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.factor import Linearization, Samples
from jointscope.factors.step import Steps, row_names
from jointscope.robots.dynamics.accelerations import Accelerations
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DynamicsFactor(ABC):
    """The equations of motion between two ticks; residual = integrated motion that the model does not explain.

    Attributes:
        model: accelerations.
        steps: step lengths, commands and noise.
        joints: names of the joints.
    """

    model: ElasticJoints
    steps: Steps
    joints: tuple[str, ...]

    name = "dynamics"
    states = 2
    blocks = (DYNAMICS,)
    behind = 0.0
    """Part of h/2 d_v by which positions lag behind a torque that acts throughout; 1 where they take no later speed."""

    def __len__(self) -> int:
        return len(self.steps)

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows: velocities, then positions; link before motor."""
        return row_names(self.model.layout)

    @property
    def sigmas(self) -> Array:
        """Standard deviations of the rows, shape (m, d) [rad/s], [rad]."""
        return self.steps.sigmas

    def select(self, samples: Samples) -> DynamicsFactor:
        """The same factor for some of the steps."""
        return replace(self, steps=self.steps.select(samples))

    def with_noise(self, noise: ProcessNoise) -> DynamicsFactor:
        """The same factor with another process noise."""
        return replace(self, steps=replace(self.steps, noise=noise))

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Defects of velocities and positions over each step, shape (m, d)."""
        d_v, d_q = self.defects(x[0], x[1], calibration.values)
        found, plays = self.combined(d_v, d_q), self.model.plays
        if plays is not None:
            h = plays.sizes(self.model.named(calibration.values))
            found[:, plays.rows] = x[1][:, plays.lags] - plays.after(x[0], x[1], h)
        return found

    def combined(self, d_v: Array, d_q: Array) -> Array:
        """Rows whose noise is independent, of this rule; see `Steps.combine`."""
        return self.steps.combine(d_v, d_q, self.behind)

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Defects and derivatives."""
        return self._with_plays(self.linearize_pairs(x[0], x[1], calibration), x[0], x[1], calibration)

    def linearize_chain(self, x: Array, calibration: Calibration) -> Linearization:
        """As `linearize` for consecutive ticks, x of shape (m + 1, d); may share work between steps."""
        return self._with_plays(self.linearize_neighbours(x, calibration), x[:-1], x[1:], calibration)

    def linearize_neighbours(self, x: Array, calibration: Calibration) -> Linearization:
        """As `linearize_pairs` for consecutive ticks."""
        return self.linearize_pairs(x[:-1], x[1:], calibration)

    def _with_plays(self, found: Linearization, x0: Array, x1: Array, calibration: Calibration) -> Linearization:
        """With the rows of lags of encoders, which no rate moves; in place."""
        plays = self.model.plays
        if plays is None:
            return found
        values = self.model.named(calibration.values)
        after, inside, by_size = plays.with_slopes(x0, x1, plays.sizes(values))
        found.residual[:, plays.rows] = x1[:, plays.lags] - after
        (J0, J1), by_parameter = found.by_state, found.by_block[DYNAMICS]
        for i, (row, lag, q) in enumerate(zip(plays.rows, plays.lags, plays.positions, strict=True)):
            J0[:, row], J1[:, row], by_parameter[:, row] = 0.0, 0.0, 0.0
            J0[:, row, lag], J0[:, row, q] = -inside[:, i], inside[:, i]
            J1[:, row, lag], J1[:, row, q] = 1.0, -inside[:, i]
            if plays.widths[i] in self.model.names:
                column = self.model.names.index(plays.widths[i])
                by_parameter[:, row, column] = -by_size[:, i] * calibration.value_by_coordinate[column]
        return found

    @abstractmethod
    def defects(self, x0: Array, x1: Array, parameters: Array) -> tuple[Array, Array]:
        """Defects of velocities with memories, shape (m, r), and of positions, shape (m, k)."""

    @abstractmethod
    def linearize_pairs(self, x0: Array, x1: Array, calibration: Calibration) -> Linearization:
        """Defects and derivatives for m pairs of states."""

    def assemble(
        self,
        defects: tuple[Array, Array],
        by_x0: tuple[Array, Array],
        by_x1: tuple[Array, Array],
        by_parameter: tuple[Array, Array],
        calibration: Calibration,
        middle: Accelerations,
    ) -> Linearization:
        """Puts the halves together, adds the response to changed commands, changes parameters to coordinates.

        Args:
            defects: of rates and of positions.
            by_x0: their derivatives by the first state.
            by_x1: their derivatives by the second state.
            by_parameter: their derivatives by the dynamics parameters.
            calibration: where this is.
            middle: accelerations within the step; they tell how a change of the command acts.
        """
        self._add_commands(by_parameter, calibration, middle)
        dynamics = self.combined(*by_parameter) * calibration.value_by_coordinate
        return Linearization(
            self.combined(*defects),
            (self.combined(*by_x0), self.combined(*by_x1)),
            {DYNAMICS: dynamics},
        )

    def command(self, parameters: Array) -> Array:
        """Commands that act in each step, shape (m, n), for values of the free parameters."""
        return self.steps.acting(self.model.named(parameters))[0]

    def commands_at_ends(self, parameters: Array) -> tuple[Array, Array]:
        """Commands that act where each step begins and where it ends, shape (m, n) each.

        A drive signal that was measured runs on within a step, and moves what it drives by h^2 / 12 of its rise
        further than a constant of the same mean.
        """
        u, rise = self.command(parameters), self.steps.rising(self.model.named(parameters))[0]
        return (u, u) if rise is None else (u - 0.5 * rise, u + 0.5 * rise)

    def _add_commands(self, by_parameter: tuple[Array, Array], calibration: Calibration, middle: Accelerations) -> None:
        """Derivative of the rate defects by what effects do to the commands, which positions follow by the rule."""
        slopes = self.steps.acting(self.model.named(calibration.values))[1]
        if not slopes:
            return
        response = self.steps.h[:, None, None] * self.model.command_response(middle, calibration.values)
        for name, slope in slopes.items():
            if name in self.model.names:
                by_parameter[0][:, :, self.model.names.index(name)] -= (response @ slope[:, :, None])[:, :, 0]
