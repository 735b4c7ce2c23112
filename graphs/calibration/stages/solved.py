# SPDX-License-Identifier: BSD-3-Clause
"""A solution with what its residuals say, on which stages build and which becomes a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.stages.encoder_noise import EncoderFit, estimated_sigmas
from jointscope.graphs.calibration.stages.residual_collection import BagResiduals, collect, series_of
from jointscope.graphs.noise.noise_estimation import NoiseEvidence
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import Elimination, eliminations_of
from jointscope.graphs.solving.batch_solver import Solution
from jointscope.graphs.solving.posterior import StateSpread, posteriors
from jointscope.graphs.solving.set_problem import Problem, SetProblem
from jointscope.graphs.solving.solver_context import give_back_memory
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import LinkEncoder, MotorEncoder

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Solved:
    """A converged problem with its residuals and uncertainties.

    Attributes:
        problems: factors of each motion, with the noise used.
        solution: states and shared values, of the motions first.
        spreads: uncertainty of each motion's states.
        covariance: of all shared values, shape (s, s).
        residuals: of each recording.
        evidence: what the residuals say about the process noise.
        eliminations: of each motion's states.
        sets: recordings of other kinds.
    """

    problems: list[BagProblem]
    solution: Solution
    spreads: list[StateSpread]
    covariance: Array
    residuals: list[BagResiduals]
    evidence: NoiseEvidence
    eliminations: list[Elimination]
    sets: Sequence[SetProblem] = ()

    @property
    def robot(self) -> Robot:
        """The robot before the calibration, with the noise of sensors and motion that was used."""
        return self.problems[0].robot

    @property
    def of_motions(self) -> tuple[list[BagProblem], Sequence[Array], Sequence[Calibration]]:
        """Problems, states and values of each motion."""
        estimate, motions = self.solution.estimate, len(self.problems)
        return self.problems, estimate.states[:motions], estimate.calibrations[:motions]

    def encoder_sigmas(self, encoder: MotorEncoder | LinkEncoder, stated: Array) -> Array:
        """Sigmas that the residuals of an encoder ask for, beside those that were stated, shape (n,) both."""
        bags = [(p, c.series[encoder.name]) for p, c in zip(self.problems, self.residuals, strict=True)]
        fits = [(p.recording.streams[encoder.name], series_of(p, encoder, parts)) for p, parts in bags if parts]
        return estimated_sigmas(encoder, [EncoderFit(*fit) for fit in fits], stated)

    @staticmethod
    def of(
        problems: list[BagProblem], solution: Solution, hold: Sequence[str], sets: Sequence[SetProblem] = ()
    ) -> Solved:
        """Uncertainties and one pass over all residuals."""
        every: list[Problem] = [*problems, *sets]
        motions = len(problems)
        give_back_memory()  # the solver's
        eliminations = eliminations_of(every, solution.estimate)
        found, covariance = posteriors(every, solution, hold, eliminations)
        evidence = NoiseEvidence.empty(problems[0].robot.layout.n_rates)
        residuals = [
            collect(problem, solution, i, posterior, evidence)
            for i, (problem, posterior) in enumerate(zip(problems, found[:motions], strict=True))
        ]
        spreads = [posterior.spread for posterior in found[:motions]]
        return Solved(problems, solution, spreads, covariance, residuals, evidence, eliminations[:motions], sets)
