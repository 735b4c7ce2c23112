# SPDX-License-Identifier: BSD-3-Clause
"""(b) The fixed-lag estimator: fed with every sample as it arrives and with every command."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.planning.estimator_account import EstimatorAccount
from jointscope.tools.closed_loop.planning.reference import Reference
from jointscope.tools.simulator.loop.online_sensors import Sample
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]

LAG = 0.1  # [s]


class Estimator(Protocol):
    """What a control loop needs of `FixedLagEstimator`."""

    @property
    def events(self) -> Sequence[Any]:
        """What happened, each with a kind and a source."""

    @property
    def status(self) -> Any:
        """Counters."""

    def sample(self, name: str, t: float, values: Array) -> None:
        """A sample of a stream."""

    def command(self, t: float, u: Array) -> None:
        """A command that acts from t on."""

    def state(self, t: float | None = None) -> Any:
        """Mean and covariance, predicted to t."""


MakeEstimator = Callable[[Robot, float], Estimator]


def fixed_lag_estimator(robot: Robot, lag: float) -> Estimator:
    """The estimator of this package."""
    from jointscope.graphs.fixed_lag.estimator import FixedLagEstimator

    return FixedLagEstimator(robot, lag)


class EstimatedState:
    """The newest knowledge, predicted to the present; the plan's state as long as the estimator knows nothing.

    Args:
        estimator: of the model.
        reference: states on the plan.

    Attributes:
        seconds: wall time that each tick has cost, samples, state and command together [s].
    """

    def __init__(self, estimator: Estimator, reference: Reference):
        self._estimator, self._reference = estimator, reference
        self.seconds: list[float] = []
        self._spent = 0.0

    def take(self, sample: Sample) -> None:
        """Hands the sample on."""
        begin = time.perf_counter()
        self._estimator.sample(sample.sensor, sample.stamp, sample.values)
        self._spent += time.perf_counter() - begin

    def state(self, tick: int, now: float, past: Trajectory) -> Array:
        """The mean, shape (d,)."""
        begin = time.perf_counter()
        found = self._estimator.state(now)
        self._spent += time.perf_counter() - begin
        known = bool(np.isfinite(found.covariance).all())
        return np.asarray(found.mean) if known else self._reference.x[tick]

    def commanded(self, now: float, command: Array) -> None:
        """Hands the command on."""
        begin = time.perf_counter()
        self._estimator.command(now, command)
        self.seconds.append(self._spent + time.perf_counter() - begin)
        self._spent = 0.0

    def account(self) -> EstimatorAccount:
        """What the estimator says of itself."""
        return EstimatorAccount.of(self.seconds, self._estimator.events, self._estimator.status)
