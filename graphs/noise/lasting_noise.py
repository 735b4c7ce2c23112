# SPDX-License-Identifier: BSD-3-Clause
"""White noise beside torques that last: how large both are, on windows, with states linearised around smoothed ones.

Where a gyro sees rates that no torque explains (a soft bearing), its sigma is widened by the same rule; else the white
noise would follow it. docs/method.md says what was measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.noise.linear_smoother import LinearSmoother, Smoothed
from jointscope.graphs.noise.noise_estimation import FixedPoint, NoiseEvidence, settled
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.windows import windows_of
from jointscope.graphs.solving.solver_context import side_by_side
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]

CORRELATION_TIME = 0.01  # [s] T where torques that last stand for what a model lacks
WHITE_SHARE = 0.3  # of the model's densities: where the estimation of white beside lasting noise begins
CYCLES = 10
ANEW = 3  # cycle at which the states are close enough to be linearised for good
EXCESS = 1.2  # factor on the sigma of a gyro from which it is widened


@dataclass(frozen=True)
class LastingNoise:
    """White noise beside torques that last.

    Attributes:
        robot: the model with both.
        evidence: logarithm of their likelihood at known parameters, without what all robots of one recording share.
    """

    robot: Robot
    evidence: float

    @property
    def white(self) -> ProcessNoise:
        """Noise of the robot without torques that last; never larger than the model's own."""
        return self.robot.noise.white


@dataclass(frozen=True)
class NoiseWindows:
    """Windows of recordings whose shared values are known.

    Attributes:
        robot: the model; of its own noise only the white part counts.
        on: builds the factors of all windows for a robot.
        states: near the smoothed ones of each window, in the layout of the robot, shape (k, d).
        calibrations: shared values of each window.
    """

    robot: Robot
    on: Callable[[Robot], list[BagProblem]]
    states: list[Array]
    calibrations: list[Calibration]

    def white_evidence(self) -> float:
        """Evidence of the robot's own white noise."""
        own = without_lasting(self.robot)
        smoothers = self._smoothers(self.on(own), self._carried(own))
        return sum(side_by_side(lambda smoother: smoother.smooth(own.noise, {}).evidence, smoothers))

    def separated(
        self, correlation_time: float, cycles: int = CYCLES, widen: bool = True, near: ProcessNoise | None = None
    ) -> LastingNoise:
        """Estimates the densities of white noise and of torques that last.

        Args:
            correlation_time: of the torques [s].
            cycles: updates at the most.
            widen: whether gyros may be found noisier than their sigma.
            near: noise with another memory, where the estimation begins.
        """
        own = without_lasting(self.robot).noise
        begin = _beside(own, correlation_time) if near is None else replace(near, correlation_time=correlation_time)
        robot = replace(self.robot, noise=begin)
        windows, states, noise = self.on(robot), self._carried(robot), robot.noise
        gyros = [gyro for gyro in robot.gyros if widen and _whole(windows, gyro.name)]
        widened = {gyro.name: np.ones(len(gyro.channels)) for gyro in gyros}
        iteration, smoothers, evidence = FixedPoint(), list[LinearSmoother](), -np.inf
        for cycle in range(cycles):
            if cycle in (0, ANEW):
                smoothers = self._smoothers(windows, states)
            smooth = partial(LinearSmoother.smooth, noise=noise, widened=widened)
            smoothed = list(side_by_side(smooth, smoothers))
            states = [s.x for s in smoothed]
            found = sum((s.process for s in smoothed), NoiseEvidence.empty(robot.layout.n_rates))
            evidence = sum(s.evidence for s in smoothed)
            before, noise = noise, _not_above(iteration.update(noise, found.factors), own)
            narrow, widened = widened, {name: _wider(w, name, smoothed) for name, w in widened.items()}
            if settled(before, noise) and all(np.allclose(narrow[name], w, rtol=0.1) for name, w in widened.items()):
                break
        return LastingNoise(replace(robot, noise=noise), evidence)

    def _carried(self, robot: Robot) -> list[Array]:
        return [robot.layout.carried_over(x, self.robot.layout) for x in self.states]

    def _smoothers(self, windows: list[BagProblem], states: list[Array]) -> list[LinearSmoother]:
        given = list(zip(windows, states, self.calibrations, strict=True))
        return list(side_by_side(lambda one: LinearSmoother.of(*one), given))


def without_lasting(robot: Robot) -> Robot:
    """The robot whose process noise is white."""
    return replace(robot, noise=robot.noise.white) if robot.noise.n_lasting else robot


def separate_noise(
    problem: BagProblem, x: Array, calibration: Calibration, correlation_time: float = CORRELATION_TIME
) -> LastingNoise:
    """Estimates the densities of white noise and of torques that last, of a whole recording.

    Args:
        problem: a recording with the model's noise.
        x: smoothed states, shape (m, d).
        calibration: shared values, which stay.
        correlation_time: of the torques [s].
    """
    robot = replace(problem.robot, noise=problem.dynamics.steps.noise)
    pieces = [piece for _, piece in windows_of([problem.recording])]

    def on(robot: Robot) -> list[BagProblem]:
        return [BagProblem.of(robot, piece) for piece in pieces]

    states = [states_in(window, problem, x) for window in on(robot)]
    return NoiseWindows(robot, on, states, [calibration] * len(pieces)).separated(correlation_time)


def states_in(window: BagProblem, problem: BagProblem, x: Array) -> Array:
    """States of a whole recording, shape (m, d), at the ticks of a window, shape (k, d)."""
    return np.column_stack([np.interp(window.timeline.ticks, problem.timeline.ticks, column) for column in x.T])


def _beside(white: ProcessNoise, correlation_time: float) -> ProcessNoise:
    """Noise where an estimation begins: torques that last with the power of the white noise at low frequencies."""
    links, motors = white.link_velocity, white.motor_velocity
    less = replace(white, link_velocity=WHITE_SHARE * links, motor_velocity=WHITE_SHARE * motors)
    return less.with_lasting(correlation_time, np.concatenate([links, motors]) / np.sqrt(2.0 * correlation_time))


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
