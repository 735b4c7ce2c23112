# SPDX-License-Identifier: BSD-3-Clause
"""The window of the last ticks in GTSAM's IncrementalFixedLagSmoother.

A variable X(k) is the deviation of the state of tick k from its nominal value, in the unit of each component's scale:

    x(k) = nominal(k) + scale * X(k)

so that all numbers are of one size. Every factor is linear and was linearised where
the estimate was when its data came, so GTSAM never calls back into Python. That took an update with 12 states, 6 biases
and 100 ticks from 0.4 to 0.1 ms; docs/method.md says what was measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.robots.outside_modules import FIXED_LAG, need_module

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rows:
    """Whitened rows of a linear factor: sum of A (x - nominal) = b.

    Attributes:
        ticks: numbers of the ticks that it touches.
        A: one matrix for each, shape (r, d).
        b: shape (r,).
    """

    ticks: tuple[int, ...]
    A: tuple[Array, ...]
    b: Array


class SmootherWindow:
    """A chain of ticks, of which GTSAM holds the last ones.

    Args:
        lag: length of the window [s].
        scale: size of one unit of each component's deviation, shape (d,).

    Raises:
        JointscopeError: the installed GTSAM has no fixed-lag smoothers.
    """

    def __init__(self, lag: float, scale: Array):
        need_module("gtsam", FIXED_LAG)
        parameters = gtsam.ISAM2Params()
        parameters.setOptimizationParams(gtsam.ISAM2GaussNewtonParams(WILDFIRE))
        parameters.enableRelinearization = False  # factors are linear
        parameters.evaluateNonlinearError = False
        parameters.findUnusedFactorSlots = True
        parameters.setFactorization("QR")  # steps are a million times more certain than the first priors
        self._smoother = gtsam.IncrementalFixedLagSmoother(lag, parameters)
        self._scale, self._zero = scale, np.zeros(len(scale))
        self._graph, self._values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        self._times: dict[Any, Any] = {}
        self._removed: list[int] = []

    def add_tick(self, tick: int, time: float) -> None:
        """A new state, which the rows added before the next commit must determine."""
        key = _key(tick)
        self._values.insert(key, self._zero)
        self._times[key] = time

    def add_rows(self, rows: Rows) -> int:
        """A factor for the next commit; returns its place among the slots that this will tell."""
        noise = _unit_noise(len(rows.b))
        terms: list[Any] = []
        for tick, A in zip(rows.ticks, rows.A, strict=True):
            terms += [_key(tick), A * self._scale]
        terms += [rows.b, noise]
        self._graph.add(gtsam.LinearContainerFactor(gtsam.JacobianFactor(*terms)))
        return self._graph.size() - 1

    def remove(self, slot: int) -> None:
        """Takes a factor out with the next commit, by the slot that `commit` told."""
        self._removed.append(slot)

    def commit(self) -> Sequence[int]:
        """Runs iSAM2 on what was added; returns the slots of the new factors in the order in which they were added."""
        added = self._graph.size()
        if not (added or self._removed):
            return []
        self._smoother.update(self._graph, self._values, self._times, self._removed)
        slots = self._smoother.getISAM2Result().getNewFactorsIndices() if added else []
        self._graph, self._values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        self._times, self._removed = {}, []
        return slots

    def deviation(self, tick: int) -> Array:
        """Estimated x - nominal of a tick, shape (d,)."""
        return self._scale * self._smoother.calculateEstimateVector(_key(tick))

    def covariance(self, tick: int) -> Array:
        """Marginal covariance of a tick, shape (d, d)."""
        P = self._smoother.marginalCovariance(_key(tick))
        return P * self._scale[:, None] * self._scale

    def holds(self, tick: int) -> bool:
        """Whether a tick is in the window."""
        return self._smoother.getISAM2().valueExists(_key(tick))


WILDFIRE = 1e-5  # [scale] changes below this are not passed on to older ticks
_UNIT_NOISE: dict[int, gtsam.noiseModel.Base] = {}


def _unit_noise(rows: int) -> gtsam.noiseModel.Base:
    if rows not in _UNIT_NOISE:
        _UNIT_NOISE[rows] = gtsam.noiseModel.Unit.Create(rows)
    return _UNIT_NOISE[rows]


def _key(tick: int) -> int:
    return gtsam.symbol("x", tick)
