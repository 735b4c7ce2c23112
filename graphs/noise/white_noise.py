# SPDX-License-Identifier: BSD-3-Clause
"""The white part of the process noise: what is left of random torques when free torques take what the model lacks.

Densities of both are estimated together, on windows, with states linearised around smoothed ones. Where a gyro sees
rates that no torque explains (a soft bearing), its sigma is widened by the same rule; else the white noise would follow
it. docs/method.md says what was measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.noise.free_torque import CORRELATION_TIME, FreeTorques
from jointscope.graphs.noise.linear_smoother import LinearSmoother, Smoothed
from jointscope.graphs.noise.noise_estimation import FixedPoint, NoiseEvidence, settled
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.windows import windows_of
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]

CYCLES = 10
ANEW = 3  # cycle at which the states are close enough to be linearised for good
EXCESS = 1.2  # factor on the sigma of a gyro from which it is widened


@dataclass(frozen=True)
class SeparateNoise:
    """White noise beside free torques.

    Attributes:
        free: the robot with free torques.
        noise: its noise: white densities, own memories, free torques.
        white: noise of the robot without free torques; never larger than the model's own.
    """

    free: FreeTorques
    noise: ProcessNoise
    white: ProcessNoise


def separate_noise(
    problem: BagProblem, x: Array, calibration: Calibration, correlation_time: float = CORRELATION_TIME
) -> SeparateNoise:
    """Estimates the densities of white noise and of free torques.

    Args:
        problem: a recording with the model's noise.
        x: smoothed states, shape (m, d).
        calibration: shared values, which stay.
        correlation_time: of the free torques [s].
    """
    free = FreeTorques.of(problem.robot, correlation_time)
    own, noise = problem.dynamics.steps.noise, free.robot.noise
    known = Calibration.of(free.robot).with_points({b: calibration[b] for b in calibration.blocks if b != DYNAMICS})
    windows = [BagProblem.of(free.robot, piece) for _, piece in windows_of([problem.recording])]
    states = [_states_in(window, problem, x) for window in windows]
    widened = {gyro.name: np.ones(len(gyro.channels)) for gyro in problem.robot.gyros if _whole(windows, gyro.name)}
    iteration = FixedPoint(memories=len(free.rows))
    smoothers: list[LinearSmoother] = []
    for cycle in range(CYCLES):
        if cycle in (0, ANEW):
            smoothers = [LinearSmoother.of(w, s, known) for w, s in zip(windows, states, strict=True)]
        smoothed = [smoother.smooth(noise, widened) for smoother in smoothers]
        states = [s.x for s in smoothed]
        evidence = sum((s.process for s in smoothed), NoiseEvidence.empty(free.robot.layout.n_rates))
        before, noise = noise, _not_above(iteration.update(noise, evidence.factors), own)
        narrow, widened = widened, {name: _wider(w, name, smoothed) for name, w in widened.items()}
        if settled(before, noise) and all(np.allclose(narrow[name], w, rtol=0.1) for name, w in widened.items()):
            break
    return SeparateNoise(free, noise, free.white(noise))


def _states_in(window: BagProblem, problem: BagProblem, x: Array) -> Array:
    """States of the whole recording at the ticks of a window, free torques zero, shape (k, d)."""
    ticks = problem.timeline.ticks
    near = np.column_stack([np.interp(window.timeline.ticks, ticks, column) for column in x.T])
    return window.robot.layout.carried_over(near, problem.robot.layout)


def _whole(windows: list[BagProblem], gyro: str) -> bool:
    """Whether all factors of a gyro hold all its channels."""
    channels = len(windows[0].robot.sensors[gyro].channels)
    found = [placed.factor for window in windows for placed in window.sensors if placed.factor.name == gyro]
    return all(len(factor.rows) == channels for factor in found)


def _wider(factors: Array, gyro: str, smoothed: list[Smoothed]) -> Array:
    """Factors on a gyro's sigmas as its residuals ask for; 1 where it is no more than noise, shape (c,)."""
    evidence = sum((s.sensors[gyro] for s in smoothed), NoiseEvidence.empty(len(factors)))
    wanted = factors * evidence.factors
    return np.where(wanted > EXCESS, wanted, 1.0)


def _not_above(noise: ProcessNoise, own: ProcessNoise) -> ProcessNoise:
    """Noise with white densities of the model's own at the most."""
    return replace(
        noise,
        link_velocity=np.minimum(noise.link_velocity, own.link_velocity),
        motor_velocity=np.minimum(noise.motor_velocity, own.motor_velocity),
    )
