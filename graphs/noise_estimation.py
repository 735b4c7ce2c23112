# SPDX-License-Identifier: BSD-3-Clause
"""Process noise from the recording itself, one density per equation of motion.

At the maximum of the marginal likelihood every density s satisfies

    s^2 = sum of squared velocity defects / (m - sum of leverages)

because a defect that the fit is free to absorb says nothing about the noise. The update is that of MacKay (1992),
"Bayesian interpolation"; as it creeps where the noise is far smaller than the sensors can see, two updates are
extrapolated (Aitken) in the logarithm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Linearization
from jointscope.graphs.bag_problem import BagProblem
from jointscope.graphs.batch_solver import Estimate, Progress, Solution, newton_step, solve
from jointscope.graphs.normal_equations import accumulate, linearize_all
from jointscope.graphs.posterior import ResidualPart, posteriors, residual_parts
from jointscope.graphs.shared_layout import SharedLayout
from jointscope.robots.robot import ProcessNoise

Array = NDArray[np.float64]

SMALLEST_DENSITY = 1e-3  # [rad/s/sqrt(s)] below this, rounding in the Hessian and the integration error take over
CHANGE_TOLERANCE = 0.08  # relative change of a density that no longer matters
FAR = 5.0  # [sigma] a Gauss-Newton step beyond this is checked and damped
LARGEST_UPDATE = 1.6  # one update changes the logarithm of a density by this at the most


@dataclass
class NoiseEvidence:
    """Sums over dynamics residuals.

    Attributes:
        squares: whitened squared defects of velocities and memories, shape (r,).
        freedom: samples minus leverages, shape (r,).
    """

    squares: Array
    freedom: Array

    @staticmethod
    def empty(rates: int) -> NoiseEvidence:
        """No residuals yet, for a number of equations."""
        return NoiseEvidence(np.zeros(rates), np.zeros(rates))

    def add(self, part: ResidualPart) -> None:
        """Takes in some residuals; those of other factors are ignored."""
        if isinstance(part.factor, DynamicsFactor):
            half = len(self.squares)
            self.squares += np.sum(part.residual[:, :half] ** 2, axis=0)
            self.freedom += np.sum(1.0 - part.leverage[:, :half], axis=0)

    @property
    def factors(self) -> Array:
        """Factor by which each density should change, shape (r,)."""
        return np.sqrt(self.squares / np.maximum(self.freedom, 1.0))


def scaled(noise: ProcessNoise, factors: Array) -> ProcessNoise:
    """Noise with each density multiplied, not below the smallest; densities of memories stay."""
    link, motor, _ = np.split(factors, [len(noise.link_velocity), len(noise.link_velocity) + len(noise.motor_velocity)])
    return replace(
        noise,
        link_velocity=np.maximum(noise.link_velocity * link, SMALLEST_DENSITY),
        motor_velocity=np.maximum(noise.motor_velocity * motor, SMALLEST_DENSITY),
    )


def densities(noise: ProcessNoise) -> Array:
    """All densities, link before motor before memories, shape (r,)."""
    return np.concatenate([noise.link_velocity, noise.motor_velocity, noise.memory])


def estimate_noise(
    problems: Sequence[BagProblem],
    estimate: Estimate,
    *,
    cycles: int = 12,
    hold: Sequence[str] = (),
    progress: Progress | None = None,
) -> tuple[ProcessNoise, Estimate]:
    """Alternates between states with parameters, and noise.

    Args:
        problems: recordings or windows of them, all with the same noise.
        estimate: near the minimum for the present noise.
        cycles: updates at the most.
        hold: blocks that stay as they are.
        progress: called with a text and the share done.

    Returns:
        The noise, and the estimate that belongs to it.
    """
    noise = problems[0].dynamics.steps.noise
    before: tuple[Array, Array] | None = None
    for cycle in range(cycles):
        if progress:
            progress("process noise", cycle / cycles)
        evidence, estimate = _cycle([p.with_noise(noise) for p in problems], estimate, hold)
        log_now, log_change = np.log(densities(noise)), np.log(evidence.factors)
        boost = np.ones_like(log_change) if before is None else _aitken(before, (log_now, log_change))
        step = np.clip(log_change * boost, -LARGEST_UPDATE, LARGEST_UPDATE)
        before = (log_now, log_change)
        new = scaled(noise, np.exp(step))
        settled = np.abs(np.log(densities(new) / densities(noise))) < CHANGE_TOLERANCE
        noise = new
        if np.all(settled):
            break
    return noise, estimate


def _cycle(
    problems: Sequence[BagProblem], estimate: Estimate, hold: Sequence[str], damped: bool = False
) -> tuple[NoiseEvidence, Estimate]:
    """Evidence and estimate one Gauss-Newton step further, from one linearization."""
    bags = list(zip(problems, estimate.states, estimate.calibrations, strict=True))
    linearized = [list(linearize_all(*bag)) for bag in bags]
    systems = [accumulate(parts, x, c) for parts, (_, x, c) in zip(linearized, bags, strict=True)]
    shared = SharedLayout.of(estimate.calibrations[0], len(problems))
    here = Solution(estimate, float("nan"), np.zeros((0, 0)), shared, systems)
    step = newton_step(problems, here, hold)
    if step.in_sigmas > FAR and not damped:
        # too far for a step that nobody checks: two checked ones first
        return _cycle(problems, solve(problems, estimate, max_iterations=2, hold=hold).estimate, hold, damped=True)
    found, _ = posteriors(problems, here, hold)
    evidence = NoiseEvidence.empty(problems[0].robot.layout.n_rates)
    for i, (parts, posterior) in enumerate(zip(linearized, found, strict=True)):
        dynamics = [part for part in parts if isinstance(part[0], DynamicsFactor)]
        dx = step.dx[i]
        local = shared.step(step.dp, i)[DYNAMICS]
        moved = [(factor, ticks, _after(linear, ticks, dx, local)) for factor, ticks, linear in dynamics]
        for part in residual_parts(moved, estimate.calibrations[i], posterior):
            evidence.add(part)
    return evidence, step.estimate


def _after(linear: Linearization, ticks: NDArray[np.intp], dx: Array, dp: Array) -> Linearization:
    """A linearization with the residual that it predicts after a step."""
    residual = linear.residual + linear.by_block[DYNAMICS] @ dp
    for i, J in enumerate(linear.by_state):
        residual = residual + np.einsum("kri,ki->kr", J, dx[ticks + i])
    return replace(linear, residual=residual)


def _aitken(before: tuple[Array, Array], now: tuple[Array, Array]) -> Array:
    """How much further than one update the fixed point lies, between 1 and 5."""
    moved = now[0] - before[0]
    slope = 1.0 + (now[1] - before[1]) / np.where(np.abs(moved) < 1e-6, np.inf, moved)
    return 1.0 / (1.0 - np.clip(slope, 0.0, 0.8))
