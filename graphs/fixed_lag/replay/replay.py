# SPDX-License-Identifier: BSD-3-Clause
"""Feeds a recording to the fixed-lag estimator message by message, in the order in which they were received."""

from __future__ import annotations

import gc
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from time import perf_counter

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.estimator import FixedLagEstimator
from jointscope.graphs.fixed_lag.messages.event import Event
from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
from jointscope.graphs.fixed_lag.replay.tick_log import TickLog
from jointscope.graphs.fixed_lag.tick import Tick
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.arrivals import Arrivals
from jointscope.robots.recordings.recording import Recording

EVENTS = 5000  # kept in the result; all are counted
SMOOTHED_EVERY = 20  # ticks from one state at the lag to the next: with its covariance it costs more than an update
Listener = Callable[[Tick, EstimatedState | None, tuple[Event, ...]], None]


def replay(
    robot: Robot,
    recording: Recording | Iterable[Arrivals],
    lag: float = 0.1,
    *,
    adapt: Mapping[str, float] | None = None,
    smoothed_every: int = SMOOTHED_EVERY,
    listener: Listener | None = None,
    progress: Callable[[float], None] | None = None,
) -> ReplayResult:
    """Replays a recording as the control loop would have seen it.

    Args:
        robot: the model.
        recording: blocks of messages as they were received, or a recording, which has lost its duplicates; other joints
            are held where its `posture` says, if it has one.
        lag: length of the window [s].
        adapt: parameters that may walk: full name and density [unit/sqrt(s)].
        smoothed_every: the state at the lag is read at every so-manieth tick.
        listener: called after each update with the tick, the state at the lag (None where it is not read or the window
            is not full) and the events since the update before; its time does not count.
        progress: called with the stamp of the newest command now and then [s].

    Raises:
        EstimatorError: an impossible lag or parameter.
        RecordingError: the messages never led to an update, or the bag cannot be read.
    """
    robot = robot.in_posture(getattr(recording, "posture", {}))
    run = _Run(robot, lag, adapt, smoothed_every, listener, progress)
    gc.collect()
    gc.freeze()  # what is there by now need not be looked through in the middle of an update
    try:
        for block in [Arrivals.of(recording)] if isinstance(recording, Recording) else recording:
            run.feed(block)
        return run.result()
    finally:
        gc.unfreeze()


class _Run:
    """An estimator with a stopwatch and a notebook."""

    def __init__(
        self,
        robot: Robot,
        lag: float,
        adapt: Mapping[str, float] | None,
        smoothed_every: int,
        listener: Listener | None,
        progress: Callable[[float], None] | None,
    ):
        self._robot, self._lag, self._adapt = robot, lag, dict(adapt or {})
        self._every, self._listener, self._progress = max(smoothed_every, 1), listener, progress
        self._log = TickLog(robot)
        self._events: list[Event] = []
        self._counts: Counter[str] = Counter()
        self._newest_event: Event | None = None
        self._first, self._last, self._messages = float("inf"), float("-inf"), 0
        self._spent = self._wall = self._outside = 0.0
        self._begin = perf_counter()
        self._estimator = FixedLagEstimator(robot, lag, adapt=adapt, listener=self._ticked)

    def feed(self, block: Arrivals) -> None:
        """Hands the messages of a block over one by one."""
        if len(block):
            self._first = min(self._first, float(block.stamps.min()))
            self._last = max(self._last, float(block.stamps.max()))
        sample, start, outside = self._estimator.sample, perf_counter(), self._outside
        for (_, name, stamp, values), about in zip(block, block.channels(), strict=True):
            self._begin = perf_counter()
            sample(name, stamp, values) if about is None else sample(name, stamp, values, about)
            self._spent += perf_counter() - self._begin
        self._messages += len(block)
        self._wall += perf_counter() - start - (self._outside - outside)
        if self._progress:
            self._progress(self._last)

    def result(self) -> ReplayResult:
        """Everything that was written down.

        Raises:
            RecordingError: there was no update.
        """
        log, status = self._log, self._estimator.status
        self._begin = perf_counter()
        self._estimator.state()  # closes the last tick, for which no later message came
        self._note(self._new_events())
        if not log.ticks:
            got = ", ".join(f"{count} of {name}" for name, count in status.received.items()) or "none"
            raise RecordingError(
                f"the estimator made no update from {self._messages} messages ({got}); it needs commands and encoder "
                "samples whose stamps come from one clock"
            )
        return ReplayResult(
            robot=self._robot,
            lag=self._lag,
            updates=log.ticks,
            recording_seconds=self._last - self._first,
            wall_seconds=self._wall,
            states=log.states(),
            lagged=log.lagged(),
            innovations=log.innovations(),
            covariances=log.covariances(),
            latency=log.latency(),
            events=tuple(self._events),
            event_counts=dict(self._counts),
            status=status,
            messages=self._messages,
            stride=log.stride,
            adapted=self._adapt,
        )

    def _ticked(self, tick: Tick) -> None:
        """Called by the estimator in the middle of `sample`; what happens here does not count as its time.

        But reading the state at the lag does: the estimator may have put work off until then. Its covariance does not.
        """
        wanted = self._log.ticks % self._every == 0
        lagged = tick.smoothed(covariance=False) if wanted else None
        seconds = self._spent + perf_counter() - self._begin
        if lagged is not None:
            lagged = tick.smoothed(covariance=True)
        self._log.add(tick, lagged, seconds)
        self._spent = 0.0
        events = self._new_events()
        self._note(events)
        if self._listener:
            outside = perf_counter()
            self._listener(tick, lagged, events)
            self._outside += perf_counter() - outside
        self._begin = perf_counter()

    def _new_events(self) -> tuple[Event, ...]:
        """Events since the last call, oldest first."""
        found: list[Event] = []
        for event in reversed(self._estimator.events):
            if event is self._newest_event:
                break
            found.append(event)
        if found:
            self._newest_event = found[0]
        return tuple(reversed(found))

    def _note(self, events: tuple[Event, ...]) -> None:
        if events:
            self._counts.update(event.kind for event in events)
            self._events += events[: EVENTS - len(self._events)]
