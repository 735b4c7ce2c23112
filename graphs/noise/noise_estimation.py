# SPDX-License-Identifier: BSD-3-Clause
"""Process noise from the recording itself, one density per equation of motion.

At the maximum of the marginal likelihood every density s satisfies

    s^2 = sum of squared velocity defects / (m - sum of leverages)

because a defect that the fit is free to absorb says nothing about the noise. The update is that of MacKay (1992),
"Bayesian interpolation"; as it creeps where the noise is far smaller than the sensors can see, two updates are
extrapolated (Aitken) in the logarithm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS
from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.factor import Linearization
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.batch_solver import (
    NewtonStep,
    Progress,
    Solution,
    newton_step,
    prior_cost,
    solve,
    total_cost,
)
from jointscope.graphs.solving.convergence import LAMBDA_START, measured_rows, next_damping, short_step
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import accumulate, linearize_all
from jointscope.graphs.solving.posterior import ResidualPart, posteriors, residual_parts
from jointscope.graphs.solving.set_problem import owners
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.solver_context import side_by_side
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]

UNSEEN = 1e-2  # of the random torque of a motor, that of a link which no sensor sees
SMALLEST_LASTING = 1e-3  # [rad/s^2/sqrt(s)] density of torques that last
CHANGE_TOLERANCE = 0.08  # relative change of a density that no longer matters
FAR = 5.0  # [sigma times misfit] a Gauss-Newton step beyond this is checked and damped
LARGEST_UPDATE = 1.6  # one update changes the logarithm of a density by this at the most


@dataclass
class NoiseEvidence:
    """Sums over residuals of the dynamics or of a sensor.

    Attributes:
        squares: whitened squared defects of velocities and memories, or of the channels of a sensor, shape (r,).
        freedom: samples minus leverages, shape (r,).
    """

    squares: Array
    freedom: Array

    @staticmethod
    def empty(rates: int) -> NoiseEvidence:
        """No residuals yet, for a number of equations."""
        return NoiseEvidence(np.zeros(rates), np.zeros(rates))

    @staticmethod
    def of_rows(part: ResidualPart) -> NoiseEvidence:
        """Of all rows of some residuals."""
        return NoiseEvidence(np.sum(part.residual**2, axis=0), np.sum(1.0 - part.leverage, axis=0))

    def add(self, part: ResidualPart) -> None:
        """Takes in some residuals; those of other factors are ignored."""
        if isinstance(part.factor, DynamicsFactor):
            half, free = len(self.squares), part.factor.steps.free
            told = np.ones((len(part.residual), half))
            if free is not None:  # memories follow motors that no law holds, too, but not a hand
                k = free.shape[1]
                told[:, :k], told[:, k:] = free == 0.0, np.any(free == 0.0, axis=1, keepdims=True)
            self.squares += np.sum(told * part.residual[:, :half] ** 2, axis=0)
            self.freedom += np.sum(told * (1.0 - part.leverage[:, :half]), axis=0)

    def __add__(self, other: NoiseEvidence) -> NoiseEvidence:
        """Both together."""
        return NoiseEvidence(self.squares + other.squares, self.freedom + other.freedom)

    @property
    def factors(self) -> Array:
        """Factor by which each density should change, shape (r,)."""
        told = self.freedom > 0.0  # a density of which no step tells stays
        return np.where(told, np.sqrt(self.squares / np.maximum(self.freedom, 1.0)), 1.0)


def scaled(noise: ProcessNoise, factors: Array) -> ProcessNoise:
    """Noise with each density multiplied, not below the smallest; memories of effects keep theirs.

    Args:
        noise: densities.
        factors: by density, shape (r,).
    """
    link, motor, memory = np.split(
        factors, [len(noise.link_velocity), len(noise.link_velocity) + len(noise.motor_velocity)]
    )
    kept = len(noise.memory) - noise.n_lasting
    lasting = np.maximum(noise.memory[kept:] * memory[kept:], SMALLEST_LASTING)
    velocities = np.concatenate([noise.link_velocity * link, noise.motor_velocity * motor])
    links, motors = np.split(np.maximum(velocities, noise.smallest), [len(link)])
    if len(noise.unseen):
        least = np.broadcast_to(noise.smallest, velocities.shape)[: len(links)]
        links = np.where(noise.unseen >= 0, np.maximum(UNSEEN * motors[noise.unseen], least), links)
    return replace(
        noise,
        link_velocity=links,
        motor_velocity=motors,
        memory=np.concatenate([noise.memory[:kept], lasting]),
    )


def not_below(noise: ProcessNoise, smallest: float) -> ProcessNoise:
    """Noise with the smaller densities of velocities raised."""
    factors = np.ones(len(densities(noise)))
    velocities = np.concatenate([noise.link_velocity, noise.motor_velocity])
    factors[: len(velocities)] = np.maximum(smallest / velocities, 1.0)
    return scaled(noise, factors)


def densities(noise: ProcessNoise) -> Array:
    """All densities, link before motor before memories, shape (r,)."""
    return np.concatenate([noise.link_velocity, noise.motor_velocity, noise.memory])


@dataclass
class FixedPoint:
    """Updates of all densities, each extrapolated from the last two.

    Attributes:
        before: logarithms of the densities at the last update, and the change that it asked for.
    """

    before: tuple[Array, Array] | None = None

    def update(self, noise: ProcessNoise, factors: Array) -> ProcessNoise:
        """Noise one update further; factors as the evidence at this noise asks for, shape (r,)."""
        now = np.log(densities(noise)), np.log(factors)
        boost = np.ones_like(now[1]) if self.before is None else _aitken(self.before, now)
        self.before = now
        return scaled(noise, np.exp(np.clip(now[1] * boost, -LARGEST_UPDATE, LARGEST_UPDATE)))


def settled(before: ProcessNoise, now: ProcessNoise) -> bool:
    """Whether no density changed by an amount that matters."""
    return bool(np.all(np.abs(np.log(densities(now) / densities(before))) < CHANGE_TOLERANCE))


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
    iteration, damping = FixedPoint(), LAMBDA_START
    for cycle in range(cycles):
        if progress:
            progress("process noise", cycle / cycles)
        evidence, estimate, damping = _cycle([p.with_noise(noise) for p in problems], estimate, hold, damping)
        before, noise = noise, iteration.update(noise, evidence.factors)
        if settled(before, noise):
            break
    return noise, estimate


def _cycle(
    problems: Sequence[BagProblem], estimate: Estimate, hold: Sequence[str], damping: float, damped: bool = False
) -> tuple[NoiseEvidence, Estimate, float]:
    """Evidence and estimate one Gauss-Newton step further, from one linearization.

    Checked steps, where they have to be taken, begin with a damping; the last result is that for those of next time.
    """
    bags = list(zip(problems, estimate.states, estimate.calibrations, strict=True))
    linearized = list(side_by_side(lambda bag: list(linearize_all(*bag)), bags))
    systems = list(side_by_side(lambda i: accumulate(linearized[i], *bags[i][1:]), range(len(bags))))
    shared = SharedLayout.of(estimate.calibrations, owners(problems))
    here = Solution(estimate, float("nan"), shared)
    eliminations = list(side_by_side(eliminate, systems))
    step = newton_step(problems, here, hold, eliminations=eliminations)
    cost = sum(system.cost for system in systems)
    far = step.in_sigmas > short_step(cost, FAR, measured_rows(problems))
    if far or total_cost(problems, step.estimate) > cost + prior_cost(problems, estimate.calibrations):
        # too far for a step that nobody checks: two checked ones first, and none if it is still too far
        if not damped:
            near = solve(problems, estimate, max_iterations=2, hold=hold, damping=damping)
            return _cycle(problems, near.estimate, hold, next_damping(near.iterations), damped=True)
        step = NewtonStep(estimate, 0.0, [np.zeros_like(dx) for dx in step.dx], np.zeros_like(step.dp))
    found, _ = posteriors(problems, here, hold, eliminations)
    rates = problems[0].robot.layout.n_rates

    def told(i: int) -> NoiseEvidence:
        dynamics = [part for part in linearized[i] if isinstance(part[0], DynamicsFactor)]
        dx, evidence = step.dx[i], NoiseEvidence.empty(rates)
        local = {DYNAMICS: shared.step(step.dp, i)[DYNAMICS]}
        moved = [(factor, ticks, after_step(linear, ticks, dx, local)) for factor, ticks, linear in dynamics]
        for part in residual_parts(moved, estimate.calibrations[i], found[i]):
            evidence.add(part)
        return evidence

    evidence = sum(side_by_side(told, range(len(bags))), NoiseEvidence.empty(rates))
    return evidence, step.estimate, damping


def after_step(
    linear: Linearization, ticks: NDArray[np.intp], dx: Array, dp: Mapping[str, Array] | None = None
) -> Linearization:
    """A linearization with the residual that it predicts after a step.

    Args:
        linear: of some samples.
        ticks: first state of each sample, shape (m,).
        dx: change of all states, shape (k, d).
        dp: change of the shared values by block; those that are not there stay.
    """
    residual = linear.residual
    for block, change in (dp or {}).items():
        residual = residual + linear.by_block[block] @ change
    for i, J in enumerate(linear.by_state):
        residual = residual + np.einsum("kri,ki->kr", J, dx[ticks + i])
    return replace(linear, residual=residual)


def _aitken(before: tuple[Array, Array], now: tuple[Array, Array]) -> Array:
    """How much further than one update the fixed point lies, between 1 and 5."""
    moved = now[0] - before[0]
    slope = 1.0 + (now[1] - before[1]) / np.where(np.abs(moved) < 1e-6, np.inf, moved)
    return 1.0 / (1.0 - np.clip(slope, 0.0, 0.8))
