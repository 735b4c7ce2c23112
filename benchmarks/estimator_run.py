# SPDX-License-Identifier: BSD-3-Clause
"""The estimator in the hands of a controller: every answer it gave, how long it took, and how far off it was."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from estimator_case import Case
from message_feed import Message, cycles
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag import EstimatedState, FixedLagEstimator
from jointscope.graphs.fixed_lag.tick import Tick
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

LAG = 0.1  # [s]
SETTLED = 1.0  # [s] from the beginning of a recording that does not count
SMOOTHED_EVERY = 40  # cycles; the covariance of a smoothed state costs a millisecond


class Cycle(NamedTuple):
    """The state that a controller was given, and what it took to feed the messages and ask: wall and CPU time [s]."""

    state: EstimatedState
    wall: float
    cpu: float


@dataclass(frozen=True)
class Judged:
    """Estimates beside the truth, for the joints' link and motor positions and velocities.

    Attributes:
        times: shape (m,) [s].
        estimated: shape (m, 4n).
        error: estimated - true, shape (m, 4n).
        nees: normalised estimation error squared per degree of freedom, shape (m,).
        sigma: shape (m, 4n).
    """

    times: Array
    estimated: Array
    error: Array
    nees: Array
    sigma: Array

    @staticmethod
    def of(case: Case, robot: Robot, states: list[EstimatedState]) -> Judged:
        """Holds states against the truth."""
        layout = robot.layout
        columns = np.concatenate([layout.joint_q, layout.joint_v, layout.motor_q, layout.motor_v])
        times = np.array([state.time for state in states])
        estimated = np.array([state.mean[columns] for state in states])
        P = np.array([state.covariance[np.ix_(columns, columns)] for state in states])
        error = estimated - case.truth(times)
        sigma = np.sqrt(np.einsum("kii->ki", P))
        # positions and velocities differ by orders of magnitude
        correlation = P / (sigma[:, :, None] * sigma[:, None, :])
        z = error / sigma
        nees = np.einsum("ki,ki->k", z, np.linalg.solve(correlation, z[:, :, None])[:, :, 0]) / len(columns)
        return Judged(times, estimated, error, nees, sigma)

    @property
    def link_velocity_error(self) -> Array:
        """Shape (m, n) [rad/s]."""
        n = self.error.shape[1] // 4
        return self.error[:, n : 2 * n]

    def within(self, t0: float, t1: float) -> Judged:
        """Those with t0 <= time < t1 [s]."""
        i = (self.times >= t0) & (self.times < t1)
        return Judged(self.times[i], self.estimated[i], self.error[i], self.nees[i], self.sigma[i])


@dataclass(frozen=True)
class Run:
    """One recording through the estimator.

    Attributes:
        now: states as they were asked for, without the first second.
        lagged: smoothed states at the lag, some of them; None if not wanted.
        nis: normalised innovations squared of all samples, shape (m,); and their degrees of freedom.
        dof: shape (m,).
        wall: of every cycle: its messages and `state()`, shape (m,) [s].
        estimator: at the end, with its counters and events.
    """

    now: Judged
    lagged: Judged | None
    nis: Array
    dof: Array
    wall: Array
    estimator: FixedLagEstimator

    @property
    def nis_mean(self) -> float:
        """Per degree of freedom."""
        return float(self.nis.sum() / self.dof.sum())


def run(case: Case, robot: Robot, messages: list[Message], lagged_too: bool = True) -> Run:
    """Drives the estimator through messages."""
    innovations: list[tuple[float, int]] = []

    def listen(tick: Tick) -> None:
        if tick.state.time > SETTLED:
            innovations.extend((i.nis, i.dof) for i in tick.innovations if i.used)

    estimator = FixedLagEstimator(robot, LAG, listener=listen)
    now, lagged, wall = list[EstimatedState](), list[EstimatedState](), list[float]()
    gc.collect()
    gc.freeze()
    for k, cycle in enumerate(driven(estimator, messages)):
        wall.append(cycle.wall)
        if cycle.state.time > SETTLED:
            now.append(cycle.state)
            smoothed = estimator.smoothed() if lagged_too and k % SMOOTHED_EVERY == 0 else None
            if smoothed is not None:
                lagged.append(smoothed)
    gc.unfreeze()
    nis, dof = np.array(innovations).T
    judged = (Judged.of(case, robot, states) if states else None for states in (now, lagged))
    return Run(*judged, nis, dof, np.array(wall), estimator)


def driven(estimator: FixedLagEstimator, messages: Iterable[Message], idle: bool = True) -> Iterator[Cycle]:
    """What a controller gets in every cycle; without `idle`, in those in which something arrived."""
    for _, arrived in cycles(messages):
        if not (arrived or idle):
            continue
        wall, cpu = time.perf_counter(), time.thread_time()
        for message in arrived:
            estimator.sample(message.stream, message.stamp, message.values)
        state = estimator.state()
        yield Cycle(state, time.perf_counter() - wall, time.thread_time() - cpu)
