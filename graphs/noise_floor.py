# SPDX-License-Identifier: BSD-3-Clause
"""The prediction error that sensor noise and state uncertainty alone would leave.

A missing effect inflates the process noise of a calibration. The floor therefore uses the process noise of the quiet
stretches of the recording: blocks of half a second, their lower quartile. A disturbance that is always there stays in
the floor, one that comes with the motion does not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.bag_problem import BagProblem, factor_on_state, first_command_time
from jointscope.graphs.banded_solver import eliminate
from jointscope.graphs.causal_filter import filter_around
from jointscope.graphs.noise_estimation import scaled
from jointscope.graphs.normal_equations import build, linearize_all
from jointscope.graphs.posterior import StatePosterior, residual_parts

Array = NDArray[np.float64]

BLOCK = 0.5  # [s]
QUIET = 0.25  # quantile of the blocks
SETTLING = 0.5  # [s] of motion after which the filter knows the deflection
STARTS = 400  # predictions over which the floor is averaged
FEWEST_FREE = 5.0  # degrees of freedom below which a block says nothing about its noise


def settled_from(problem: BagProblem) -> float:
    """Time from which predictions are scored [s]: the filter has seen half a second of motion.

    At rest friction hides the deflection, and after a start in motion the filter has to find it first; no prediction
    can know it before. At least half of the recording is always scored.
    """
    ticks = problem.timeline.ticks
    motion = first_command_time(problem.recording) if problem.rests else float(ticks[0])
    return min(motion + SETTLING, 0.5 * float(ticks[0] + ticks[-1]))


def floor_of(problem: BagProblem, x: Array, calibration: Calibration, horizon: float) -> float:
    """Root mean square over all channels of the expected error `horizon` seconds ahead, in sensor sigmas.

    Args:
        problem: the recording with the model's noise.
        x: smoothed states, shape (m, d).
        calibration: shared values.
        horizon: prediction horizon [s].
    """
    quiet = problem.with_noise(scaled(problem.dynamics.steps.noise, _quiet_factors(problem, x, calibration)))
    filtered = filter_around(quiet, x, calibration)
    steps = max(round(horizon / float(np.median(problem.timeline.h))), 1)
    first = int(np.searchsorted(problem.timeline.ticks, settled_from(problem)))
    last = max(len(x) - 2 - steps, 0)
    start = np.unique(np.linspace(min(first, last), last, STARTS).astype(int))
    P = filtered.covariance[start]
    for i in range(min(steps, len(x) - 2)):
        P = _advance(quiet, x, calibration, start + i, P)
    return float(np.sqrt(np.mean(_channel_variances(quiet, x[start + steps], calibration, P))))


def _quiet_factors(problem: BagProblem, x: Array, calibration: Calibration) -> Array:
    """Process noise of quiet blocks over that of the model, at most 1, shape (r,)."""
    elimination = eliminate(build(problem, x, calibration))
    p = elimination.W.shape[1]
    posterior = StatePosterior.of(elimination, np.zeros((p, p)))
    squares, freedom, times = [], [], []
    linearized = linearize_all(problem, x, calibration, dynamics_only=True)
    for part in residual_parts(linearized, calibration, posterior):
        half = problem.robot.layout.n_rates
        squares.append(part.residual[:, :half] ** 2)
        freedom.append(1.0 - part.leverage[:, :half])
        times.append(problem.timeline.ticks[part.ticks])
    block = ((np.concatenate(times) - problem.timeline.ticks[0]) / BLOCK).astype(int)
    sums = [_sum_by(block, np.concatenate(values)) for values in (squares, freedom)]
    factors = np.ones(sums[0].shape[1])
    for j in range(len(factors)):
        telling = sums[1][:, j] > FEWEST_FREE
        if np.any(telling):
            factors[j] = np.quantile(np.sqrt(sums[0][telling, j] / sums[1][telling, j]), QUIET)
    return np.minimum(factors, 1.0)


def _sum_by(block: NDArray[np.intp], values: Array) -> Array:
    return np.column_stack([np.bincount(block, weights=column) for column in values.T])


def _advance(problem: BagProblem, x: Array, calibration: Calibration, ticks: NDArray[np.intp], P: Array) -> Array:
    """Covariances one tick later: F P F' + Q."""
    chosen = problem.dynamics.select(ticks)
    linear = chosen.linearize((x[ticks], x[ticks + 1]), calibration)
    J1_inverse = np.linalg.inv(linear.by_state[1])
    F = -J1_inverse @ linear.by_state[0]
    G = J1_inverse * chosen.sigmas[:, None, :]
    return F @ P @ F.transpose(0, 2, 1) + G @ G.transpose(0, 2, 1)


def _channel_variances(problem: BagProblem, x: Array, calibration: Calibration, P: Array) -> Array:
    """Expected squared error of every channel in sigmas, shape (s, c)."""
    found = []
    for name, sensor in problem.robot.sensors.items():
        factor = factor_on_state(problem.robot, name, np.zeros((len(x), len(sensor.channels))), np.zeros(len(x)))
        J = factor.linearize((x,), calibration).by_state[0] / sensor.sigma
        found.append(np.einsum("kri,kij,krj->kr", J, P, J, optimize=True) + 1.0)
    return np.hstack(found)
