# SPDX-License-Identifier: BSD-3-Clause
"""States of a recording whose shared values are known, linearised once: smoothing anew with other noise is cheap."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.initial_state import InitialStateFactor
from jointscope.graphs.noise.noise_estimation import NoiseEvidence, after_step
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.normal_equations import Linearized, accumulate, linearize_all
from jointscope.graphs.solving.posterior import StatePosterior, residual_parts
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Smoothed:
    """States under some noise, and what they say about it.

    Attributes:
        x: smoothed states, shape (m, d).
        process: evidence of the dynamics.
        sensors: evidence of the channels of each sensor that was asked about.
        evidence: logarithm of the likelihood of the noise, without what all noises of these factors share.
    """

    x: Array
    process: NoiseEvidence
    sensors: dict[str, NoiseEvidence]
    evidence: float


@dataclass(frozen=True)
class LinearSmoother:
    """All factors of one recording, linearised.

    Attributes:
        problem: the factors.
        x: states around which they are linearised, shape (m, d).
        calibration: known shared values.
        parts: linearizations by the states alone.
    """

    problem: BagProblem
    x: Array
    calibration: Calibration
    parts: list[Linearized]

    @staticmethod
    def of(problem: BagProblem, x: Array, calibration: Calibration) -> LinearSmoother:
        """Linearises a recording."""
        linearized = linearize_all(problem, x, calibration)
        parts = [(factor, ticks, replace(linear, by_block={})) for factor, ticks, linear in linearized]
        return LinearSmoother(problem, x, calibration, parts)

    def smooth(self, noise: ProcessNoise, widened: Mapping[str, Array]) -> Smoothed:
        """Smooths with other noise.

        Args:
            noise: of the process.
            widened: by sensor, factor on the sigma of each channel, shape (c,); evidence is wanted for these sensors.
        """
        parts = list(self._with(noise, widened))
        system = accumulate(parts, self.x, self.calibration, with_shared=False)
        elimination = eliminate(system)
        dx = elimination.states(np.zeros(0))
        posterior = StatePosterior.of(elimination, np.zeros((0, 0)))
        process = NoiseEvidence.empty(self.problem.robot.layout.n_rates)
        sensors = {name: NoiseEvidence.empty(len(factors)) for name, factors in widened.items()}
        telling = [part for part in parts if isinstance(part[0], DynamicsFactor) or part[0].name in widened]
        moved = ((factor, ticks, after_step(linear, ticks, dx)) for factor, ticks, linear in telling)
        for part in residual_parts(moved, self.calibration, posterior):
            process.add(part)
            if part.factor.name in sensors:
                sensors[part.factor.name] += NoiseEvidence.of_rows(part)
        least = system.cost - 0.5 * float(elimination.w @ elimination.w)
        volume = float(np.sum(np.log(elimination.columns[:, :, 0]))) + self._log_sigmas(noise)
        return Smoothed(self.x + dx, process, sensors, -least - volume)

    def _log_sigmas(self, noise: ProcessNoise) -> float:
        """Logarithm of the volume of one sigma of all steps and of the initial state."""
        dynamics, initial = self.problem.dynamics.with_noise(noise), self.problem.initial.with_lasting(noise.lasting)
        found = float(np.sum(np.log(dynamics.sigmas)) + np.sum(np.log(initial.sigmas)))
        if noise.n_lasting:  # a step of what decays is no plain difference
            decay = dynamics.steps.h / noise.correlation_time
            found -= noise.n_lasting * float(np.sum(np.log1p(decay / 2.0 + decay**2 / 12.0)))
        return found

    def _with(self, noise: ProcessNoise, widened: Mapping[str, Array]) -> Iterator[Linearized]:
        """The linearised factors with this noise."""
        for factor, ticks, linear in self.parts:
            if isinstance(factor, DynamicsFactor):
                yield factor.with_noise(noise), ticks, linear
            elif isinstance(factor, InitialStateFactor):
                yield factor.with_lasting(noise.lasting), ticks, linear
            elif factor.name in widened:
                weight = 1.0 / widened[factor.name]
                by_state = tuple(J * weight[:, None] for J in linear.by_state)
                yield factor, ticks, replace(linear, residual=linear.residual * weight, by_state=by_state)
            else:
                yield factor, ticks, linear
