# SPDX-License-Identifier: BSD-3-Clause
r"""The estimator for the control loop: give it messages as they come, ask it for the state.

    est = FixedLagEstimator(robot, lag=0.1)
    est.encoder(t, q); est.gyro("imu1", t, w); x = est.state(t); est.command(t, u)

    X(k-100) --D-- ... --D-- X(k-1) --D-- X(k)      D  dynamics of a step, with the command that acted
       |                        |    \   /   |       E  encoder   G  gyro, at ticks or between them
     prior                      E     G     E       every X holds the biases of the gyros, which walk slowly

There is a tick at every command; samples sit where they were taken. Bad data are counted and told, never raised.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointscope.graphs.calibration.base_model import with_full_gyros
from jointscope.graphs.fixed_lag.estimated_state import EstimatedState, state_of, unknown_state
from jointscope.graphs.fixed_lag.messages.bookkeeping import Bookkeeping
from jointscope.graphs.fixed_lag.messages.command_history import CommandHistory
from jointscope.graphs.fixed_lag.messages.event import Event
from jointscope.graphs.fixed_lag.messages.waiting_messages import WaitingMessages
from jointscope.graphs.fixed_lag.tick import Listener, Tick
from jointscope.graphs.fixed_lag.window.adaptation import checked_densities
from jointscope.graphs.fixed_lag.window.first_state import FirstSamples, first_state
from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.graphs.fixed_lag.window.newest_state import NewestState
from jointscope.graphs.fixed_lag.window.observation import AT_TICK
from jointscope.graphs.fixed_lag.window.tick_engine import TickEngine
from jointscope.graphs.fixed_lag.window_access import WindowAccess
from jointscope.graphs.problem.timeline import LONGEST_STEP, SHORTEST_STEP
from jointscope.robots.errors import EstimatorError
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Found = TypeVar("Found")

BIAS_WALK = 1e-5  # [rad/s/sqrt(s)] a gyro's bias moves by 1e-4 rad/s in 100 s
GAP = 0.3  # [s] without a tick after which the estimator begins anew; so far it predicts
BROKEN = (RuntimeError, IndexError, np.linalg.LinAlgError)  # what GTSAM and numpy raise where numbers are impossible
RAN_AWAY = ": by the last commands the robot would turn as nothing does; are their size and unit right?"
NEAR = 0.3  # share of the usual distance of commands below which a command makes no tick of its own


class FixedLagEstimator(WindowAccess):
    """State of a robot from the messages of its sensors, now and at the lag.

    Args:
        robot: calibrated; its noise, effects and priors of the biases are used.
        lag: length of the window over which the state is smoothed [s].
        adapt: parameters that may walk, by full name, and the density of their walk [unit/sqrt(s)].
        listener: called after each update.

    Attributes:
        robot: with every gyro predicted in full.
        status: counters, alarms.
        layout, lag: of the robot's state; length of the window [s].

    Raises:
        EstimatorError, RobotError: impossible lag, parameter that cannot be adapted; robot without equations of motion.
    """

    def __init__(
        self,
        robot: Robot,
        lag: float = 0.1,
        *,
        adapt: Mapping[str, float] | None = None,
        listener: Listener | None = None,
    ):
        if not (math.isfinite(lag) and lag > 0.0):
            raise EstimatorError(f"lag is {lag:g} s; expected a positive number of seconds, such as 0.1")
        if not isinstance(robot, Robot):
            raise EstimatorError(f"expected a Robot, as load_robot('doggy') gives one, got {robot!r}")
        robot.need_link_dynamics()
        self.robot = with_full_gyros(robot)
        self.layout, self.lag, self._listener = self.robot.layout, lag, listener
        self._engine = TickEngine(self.robot, lag, checked_densities(self.robot, adapt or {}), BIAS_WALK)
        self._books = Bookkeeping(self.robot, lag)
        self.status = self._books.status
        self._waiting = WaitingMessages(self._engine, self._books, CommandHistory(self.robot, lag))
        self._first = FirstSamples(self.robot)
        self._wanted: float | None = None  # stamp of a command whose tick is not closed yet
        self._newest_sample = -math.inf

    @property
    def events(self) -> list[Event]:
        """What happened, oldest first; the last thousand."""
        return list(self._books.log.events)

    def command(self, t: float, u: ArrayLike, about: NDArray[np.bool_] | None = None) -> None:
        """A command that acts from t [s] on, shape (n,), SI unit of the robot's command; `about` as in `sample`."""
        values = self._books.intake.command(t, u, self._now, about)
        if values is None:
            return
        if self.status.running:
            self._close_before(t)
        self._waiting.commands.add(t, values, about)
        newest = self._now
        if newest is None:
            return
        self._books.watch.commanded(t, about)
        if self._waiting.commands.acts_until(t) <= self._engine.past[0].time:
            self._books.intake.too_late("command", t, newest)
            return
        self.status.used["command"] += 1
        since = self._waiting.commands.unsure_since(t)
        if since < self._engine.time - AT_TICK:
            # what happened in the gap before it is now seen differently
            self._waiting.late_command = min(since, self._waiting.late_command)
        if t < newest - AT_TICK:
            self.status.late["command"] += 1
        elif t - newest > min(NEAR * self._waiting.commands.period, LONGEST_STEP):
            self._wanted = t

    def encoder(self, t: float, q: ArrayLike) -> None:
        """Positions of all motors with stamp t [s], shape (n,) [rad]; channels that are NaN are left out."""
        self.sample(self.robot.motor_encoder.name, t, q)

    def gyro(self, name: str, t: float, w: ArrayLike) -> None:
        """Rate of a gyro with stamp t [s] in its own frame, shape (3,) [rad/s]."""
        self.sample(name, t, w)

    def sample(self, name: str, t: float, values: ArrayLike, about: NDArray[np.bool_] | None = None) -> None:
        """A message of any stream.

        Args:
            name: "command", or a sensor of the robot.
            t: stamp [s].
            values: shape (c,), SI.
            about: channels that a message is about, shape (c,), where drivers send one for each joint; the others count
                as neither measured nor lost, and commands act on. None for all.

        Raises:
            EstimatorError: unknown stream or wrong shape.
        """
        if name == "command":
            self.command(t, values, about)
            return
        observations = self._books.intake.sample(name, t, values, self._now, about)
        if self._books.clock.was_set:
            self._go_to(t)
        if not observations:
            return
        if not self.status.running:
            if self._first.add(observations) and not self._books.intake.waits_for_commands:
                self._start()
            return
        self._books.watch.seen(name, t)
        oldest = self._engine.past[0].time
        fresh = [o for o in observations if o.taken >= oldest]
        if len(fresh) < len(observations):
            self._books.intake.too_late(name, t, self._engine.time)
        if fresh:
            self._newest_sample = max(self._newest_sample, fresh[0].taken)
            self._close_before(max(o.taken for o in fresh))
            self._waiting.samples += fresh if self.status.running else []

    def state(self, t: float | None = None) -> EstimatedState:
        """The robot's state with all that is known by now.

        Args:
            t: when [s]; the newest tick or sample if left out. Later times are predicted with the last command, up to
                0.3 s ahead; beyond that nothing is known and the covariance infinite.

        Raises:
            EstimatorError: a time that is not finite.
        """
        if t is not None and not math.isfinite(t):
            raise EstimatorError(f"state at {t} s: expected a finite time, or None for the newest")
        if self.status.running:
            self._catch_up(t)
        if not self.status.running or (t is not None and t > self._engine.time + GAP):
            time = t if t is not None else max(self._newest_sample, 0.0)
            q = self._engine.newest.mean[self.layout.motor_q] if self.status.running else self._first.newest
            return unknown_state(self.robot, self._engine.layout.parameters, time, q, time - self._newest_sample)
        when = self._engine.time if t is None else max(t, self._engine.time)
        return self._state_of(when, self._engine.ahead(when, self._waiting.acting))

    @property
    def _now(self) -> float | None:
        """Time of the newest tick, closed or not [s]; None before there is one."""
        if not self.status.running:
            return None
        return self._engine.time if self._wanted is None else self._wanted

    def _unbroken(self, work: Callable[[], Found]) -> Found | None:
        """What some work of the engine finds; None, and a new beginning, where its numbers are impossible."""
        try:
            return work()
        except BROKEN as err:
            self._restart(self._engine.time, f"the numbers of an update broke down ({type(err).__name__})")
            return None

    def _start(self) -> None:
        layout, before = self._engine.layout, self._engine.kept if self.status.restarts else None
        time, state = first_state(self.robot, layout, self._first.samples, before)
        self._engine.start(time, state)
        self._forget()
        self._waiting.commands.forget_after(time + GAP)
        self._newest_sample = time
        self.status.running = True
        self._books.log.tell(time, "started", "estimator", f"states are estimated from {time:.3f} s on")

    def _close_before(self, t: float) -> None:
        """Closes the ticks that a message with stamp t shows to be complete; they go on where commands have stopped."""
        if self._wanted is not None and t > self._wanted + AT_TICK:
            self._close(self._wanted)
        newest = self._now
        if newest is None:
            return
        if t - newest > GAP:
            self._restart(t, f"nothing came for {t - newest:.2f} s")
            return
        if t - newest > 1.5 * LONGEST_STEP and self._wanted is None:
            self._close(t - SHORTEST_STEP)

    def _catch_up(self, t: float | None) -> None:
        """Closes what is open at the time for which a state is wanted."""
        if self._wanted is not None and (t is None or self._wanted <= t + AT_TICK):
            self._close(self._wanted)
        if not self.status.running:
            return
        waiting, newest = self._waiting, self._waiting.newest
        if newest > self._engine.time + AT_TICK and (t is None or newest <= t + AT_TICK):
            self._close(newest)
        elif (waiting.samples and self._wanted is None) or waiting.late_command < math.inf:
            self._unbroken(waiting.take_late_ones)

    def _close(self, time: float) -> None:
        """Goes on to a new tick; where commands are missing on the way, their ticks are made, too."""
        begin, parts = self._engine.time, max(self._waiting.parts(time - self._engine.time), 1)
        for i in range(1, parts + 1):
            if self.status.running:
                self._close_one(time if i == parts else begin + (time - begin) * i / parts)

    def _close_one(self, time: float) -> None:
        """One update: late messages, the step to a new tick, its samples."""
        began = clock.perf_counter()
        found = self._unbroken(lambda: self._waiting.up_to(time))
        if self._wanted is not None and time >= self._wanted - AT_TICK:
            self._wanted = None
        if found is not None:
            self._finish(*found, clock.perf_counter() - began)

    def _finish(self, innovations: list[Innovation], fresh: int, seconds: float) -> None:
        """Counts, sanity, listener; the last `fresh` innovations were not counted yet."""
        began, engine = clock.perf_counter(), self._engine
        self._books.count(innovations[len(innovations) - fresh :])
        fits = self._books.updated(engine.time, innovations)
        if not (fits and engine.newest.is_possible):
            gone = f"became impossible{RAN_AWAY * engine.ran_away}"
            why = gone if fits else "contradicted the encoders for a tenth of a second"
            self._restart(engine.time, f"the estimate {why}")
            return
        if self._listener is not None:
            state = self._state_of(engine.time, engine.newest)
            seconds += clock.perf_counter() - began
            self._listener(Tick(state, tuple(innovations), seconds, self.smoothed))

    def _restart(self, t: float, reason: str) -> None:
        self.status.running, self.status.restarts = False, self.status.restarts + 1
        self._forget()
        kept = "biases are kept" if self._engine.kept is not None else "with biases as in the robot file"
        self._books.log.tell(t, "restarted", "estimator", f"{reason}; the estimator begins anew, {kept}")

    def _go_to(self, t: float) -> None:
        """Begins anew where the encoders' stamps are now."""
        if self.status.running:
            self._restart(t, f"the stamps of the encoders went from {self._engine.time:.3f} s to {t:.3f} s")
        self._books.clock_was_set()
        self._waiting.commands, self._newest_sample = CommandHistory(self.robot, self.lag), -math.inf

    def _forget(self) -> None:
        """Nothing of what waits is used any more."""
        self._first.samples.clear()
        self._waiting.forget()
        self._books.begins_anew()
        self._wanted = None

    def _state_of(self, time: float, found: NewestState) -> EstimatedState:
        return state_of(self._engine.layout, time, found, time - self._newest_sample)
