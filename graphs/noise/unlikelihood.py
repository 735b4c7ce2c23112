# SPDX-License-Identifier: BSD-3-Clause
"""How unlikely recordings are under a model and its noise: to compare models whose states fill other volumes.

The lowest cost alone is no likelihood: with freer states it falls, as they follow the noise of the readings. Integrated
over the states, in Laplace's approximation,

    -log p = lowest cost + 1/2 log det A + sum of log sigma of all residuals + what models have in common

A is the Hessian of all states (MacKay, Information Theory, Inference, and Learning Algorithms, 2003, chapter 27).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.graphs.noise.noise_estimation import densities
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminations_of
from jointscope.graphs.solving.batch_solver import Solution


def unlikelihood(problems: Sequence[BagProblem], solution: Solution) -> float:
    """-log p of the readings of some recordings, up to what changes neither with effects nor with noise.

    Args:
        problems: the recordings, with the noise at which they were solved.
        solution: of these and no other recordings.
    """
    volumes = 0.5 * sum(elimination.log_determinant for elimination in eliminations_of(problems, solution.estimate))
    return solution.cost + volumes + sum(_of_steps(problem) + _of_encoders(problem) for problem in problems)


def _of_steps(problem: BagProblem) -> float:
    """Sum of log sigma of the dynamics: a density scales the defects of velocities and, integrated, of positions."""
    noise = problem.dynamics.steps.noise
    own = np.log(densities(noise))
    moving = len(noise.link_velocity) + len(noise.motor_velocity)
    twice = own[:moving].sum() if noise.model == "integrated" else 0.0
    return float(len(problem.dynamics) * (own.sum() + twice))


def _of_encoders(problem: BagProblem) -> float:
    """Sum of log sigma of the samples of encoders, whose sigmas a calibration finds anew."""
    found = 0.0
    for encoder in (problem.robot.motor_encoder, problem.robot.link_encoder):
        if encoder is not None and encoder.name in problem.recording.streams:
            told = np.isfinite(problem.recording.streams[encoder.name].values).sum(axis=0)
            found += float(told @ np.log(encoder.sigmas))
    return found
