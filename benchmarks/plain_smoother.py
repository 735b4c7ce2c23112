# SPDX-License-Identifier: BSD-3-Clause
"""What GTSAM's fixed-lag smoother takes as it stands: one custom factor in Python for every sample and every step.

Parameters and mounting are known, so the variables are the states in the window and the biases of the gyros, which all
ticks share.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration, bias_block
from jointscope.factors.factor import Factor, Linearization, Samples
from jointscope.factors.single import block_key, single_factor, state_key
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KnownModel:
    """A factor whose parameters and rotations are known: only states and biases are variables."""

    factor: Factor
    calibration: Calibration

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.factor)

    @property
    def name(self) -> str:
        """As the factor's."""
        return self.factor.name

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows."""
        return self.factor.rows

    @property
    def sigmas(self) -> Array:
        """Standard deviation of each row."""
        return self.factor.sigmas

    @property
    def blocks(self) -> tuple[str, ...]:
        """The biases among the blocks of the factor."""
        biases = {bias_block(name) for name in self.calibration.biases}
        return tuple(block for block in self.factor.blocks if block in biases)

    def select(self, samples: Samples) -> KnownModel:
        """Some of the samples."""
        return replace(self, factor=self.factor.select(samples))

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """As the factor's."""
        return self.factor.residual(x, calibration)

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """As the factor's."""
        return self.factor.linearize(x, calibration)


class PlainSmoother:
    """Feeds a recording tick by tick to `gtsam.IncrementalFixedLagSmoother`.

    Args:
        robot: with every gyro in full.
        recording: all stamps at ticks.
        lag: [s].

    Attributes:
        newest: state of the newest tick, shape (d,).
    """

    def __init__(self, robot: Robot, recording: Recording, lag: float):
        self._problem = BagProblem.of(robot, recording)
        self._like = Calibration.of(robot)
        self.newest, self._tick = initial_states(self._problem, self._like)[0], 0
        parameters = gtsam.ISAM2Params()
        parameters.findUnusedFactorSlots = True
        parameters.setFactorization("QR")
        self._smoother = gtsam.IncrementalFixedLagSmoother(lag, parameters)
        self._biases = [block_key(bias_block(name), self._like) for name in self._like.biases]
        self._layout = robot.layout

    def seconds(self) -> Array:
        """Runs through the rest of the recording; seconds of every tick, newest mean and covariance included."""
        taken = []
        while self._tick < len(self._problem.timeline.ticks):
            began = time.perf_counter()
            self.advance()
            self.covariance()
            taken.append(time.perf_counter() - began)
        return np.array(taken)

    def advance(self) -> Array:
        """One tick with its samples; the newest state, shape (d,)."""
        k, layout, timeline = self._tick, self._layout, self._problem.timeline
        guess, values, graph = self.newest.copy(), gtsam.Values(), self._graph(k)
        if k:
            guess[layout.positions] += timeline.h[k - 1] * self.newest[layout.velocities]
        else:
            for key, bias in zip(self._biases, self._like.biases.values(), strict=True):
                values.insert(key, bias)
        values.insert(state_key(k), guess)
        self._smoother.update(graph, values, dict.fromkeys([state_key(k), *self._biases], float(timeline.ticks[k])))
        self.newest, self._tick = self._smoother.calculateEstimateVector(state_key(k)), k + 1
        return self.newest

    def covariance(self) -> Array:
        """Of the newest state, shape (d, d)."""
        return self._smoother.marginalCovariance(state_key(self._tick - 1))

    def _graph(self, k: int) -> gtsam.NonlinearFactorGraph:
        """Factors whose last state is that of tick k."""
        graph = gtsam.NonlinearFactorGraph()
        if k:
            self._add(graph, self._problem.dynamics, k - 1, (k - 1, k))
        for placed in self._problem.placed:
            states = placed.factor.states
            if states == 0 and k == 0:
                for sample in range(len(placed.factor)):
                    self._add(graph, placed.factor, sample, ())
            elif states:
                first = k - states + 1
                for sample in range(*np.searchsorted(placed.ticks, [first, first + 1])):
                    self._add(graph, placed.factor, sample, tuple(range(first, k + 1)))
        return graph

    def _add(self, graph: gtsam.NonlinearFactorGraph, factor: Factor, sample: int, ticks: tuple[int, ...]) -> None:
        known = KnownModel(factor, self._like)
        if ticks or known.blocks:
            graph.add(single_factor(known, sample, ticks, self._like))
