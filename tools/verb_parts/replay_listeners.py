# SPDX-License-Identifier: BSD-3-Clause
"""Who listens to a replay: several at once, and the one that holds it back to real time."""

from __future__ import annotations

import time
from collections.abc import Callable

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.messages.event import Event
from jointscope.graphs.fixed_lag.tick import Tick

Listener = Callable[[Tick, EstimatedState | None, tuple[Event, ...]], None]


class Listeners:
    """Calls several listeners in turn; false where there is none."""

    def __init__(self) -> None:
        self._all: list[Listener] = []

    def add(self, listener: Listener) -> None:
        """Adds one."""
        self._all.append(listener)

    def call(self, tick: Tick, lagged: EstimatedState | None, events: tuple[Event, ...]) -> None:
        """Passes a tick on."""
        for listener in self._all:
            listener(tick, lagged, events)

    def __bool__(self) -> bool:
        return bool(self._all)


class Pace:
    """Waits until the wall clock has come as far as the recording."""

    def __init__(self, speed: float):
        """`speed` is the number of recorded seconds per second."""
        self._speed = speed
        self._begin: tuple[float, float] | None = None

    def __call__(self, tick: Tick, lagged: EstimatedState | None, events: tuple[Event, ...]) -> None:
        """Waits if the replay is ahead."""
        now = time.monotonic()
        if self._begin is None:
            self._begin = now, tick.state.time
        wall, recorded = self._begin
        ahead = (tick.state.time - recorded) / self._speed - (now - wall)
        if ahead > 0.0:
            time.sleep(ahead)
