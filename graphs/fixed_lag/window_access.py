# SPDX-License-Identifier: BSD-3-Clause
"""What a program may ask of the estimator's window, and put into it: smoothed states, keys, factors of its own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from numbers import Real
from typing import TypeVar

import gtsam

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.messages.status import EstimatorStatus
from jointscope.graphs.fixed_lag.window.newest_state import NewestState
from jointscope.graphs.fixed_lag.window.tick_engine import TickEngine
from jointscope.graphs.fixed_lag.window.users_factor import tick_key
from jointscope.graphs.problem.timeline import LONGEST_STEP
from jointscope.robots.errors import EstimatorError

Found = TypeVar("Found")

NO_STATE = "the estimator has no state yet"


class WindowAccess(ABC):
    """The part of the estimator that looks into its window."""

    status: EstimatorStatus
    lag: float
    _engine: TickEngine

    def smoothed(self, covariance: bool = True) -> EstimatedState | None:
        """The state at the lag, smoothed with everything since; None until the window is full.

        Args:
            covariance: whether it is wanted; it costs a millisecond.
        """
        if not self.status.running or self._engine.time - self._engine.past[0].time < 0.9 * self.lag:
            return None
        found = self._unbroken(lambda: self._engine.smoothed(covariance))
        return None if found is None else self._state_of(*found)

    def newest_of_window(self) -> EstimatedState | None:
        """The newest tick as GTSAM's window has it: `state()` up to rounding, and slower; None before the start."""
        if not self.status.running:
            return None
        found = self._unbroken(self._engine.from_window)
        return None if found is None else self._state_of(self._engine.time, found)

    def key(self, t: float | None = None) -> int:
        """GTSAM's key X(k) of the newest tick, or of the one nearest to a time [s]; for a factor of your own.

        Raises:
            EstimatorError: there is no tick yet, or none near that time is in the window.
        """
        if not isinstance(t, Real | None):
            raise EstimatorError(f"expected a time [s] or None, got {t!r}")
        if self.status.running:
            self._catch_up(t)
        if not self.status.running:
            raise EstimatorError(f"{NO_STATE}: ask for a key once `est.status.running` is true")
        times = [tick.time for tick in self._engine.past]
        when = times[-1] if t is None else t
        if not times[0] - LONGEST_STEP <= when <= times[-1] + LONGEST_STEP:
            raise EstimatorError(f"no tick at {when:g} s; the window goes from {times[0]:.3f} to {times[-1]:.3f} s")
        return tick_key(min(self._engine.past, key=lambda tick: abs(tick.time - when)).number)

    def add(self, factor: gtsam.NonlinearFactor) -> None:
        """A factor of your own on states of the window, whose keys `key` tells.

        X(k) is the state itself: the robot's layout, three biases of each gyro, adapted parameters, shape (D,). The
        factor is linearised now, and counts in the smoothed states and in the newest one.

        Raises:
            EstimatorError: a key that is not in the window, or a factor that cannot be linearised.
        """
        if not self.status.running:
            raise EstimatorError(f"{NO_STATE}: add factors once `est.status.running` is true")
        if not isinstance(factor, gtsam.NonlinearFactor):
            raise EstimatorError(f"expected a gtsam.NonlinearFactor, as gtsam.CustomFactor is, got {factor!r}")
        self._unbroken(lambda: self._engine.add(factor))

    @abstractmethod
    def _catch_up(self, t: float | None) -> None:
        """Closes what is open at the time for which a state is wanted."""

    @abstractmethod
    def _unbroken(self, work: Callable[[], Found]) -> Found | None:
        """What some work of the engine finds; None, and a new beginning, where its numbers are impossible."""

    @abstractmethod
    def _state_of(self, time: float, found: NewestState) -> EstimatedState:
        """A state in the words of the robot."""
