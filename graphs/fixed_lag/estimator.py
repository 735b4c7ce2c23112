# SPDX-License-Identifier: BSD-3-Clause
"""The estimator for the control loop: give it messages as they come, ask it for the state.

    est = FixedLagEstimator(robot, lag=0.1)
    est.encoder(t, q); est.gyro("imu1", t, w); x = est.state(t); est.command(t, u)

    X(k-100) --D-- ... --D-- X(k-1) --D-- X(k)      D  dynamics of a step, with the command that acted
       |                        |    \\   /  |       E  encoder   G  gyro, at ticks or between them
     prior                      E     G     E       every X holds the biases of the gyros, which walk slowly

There is a tick at every command; samples sit where they were taken. Bad data are counted and told, never raised.
"""

from __future__ import annotations

import math
import time as clock
from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointscope.graphs.base_model import with_full_gyros
from jointscope.graphs.fixed_lag.command_history import CommandHistory
from jointscope.graphs.fixed_lag.consistency import Consistency
from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.first_state import EncoderSample, first_state, is_enough
from jointscope.graphs.fixed_lag.innovation import Innovation
from jointscope.graphs.fixed_lag.newest_state import NewestState
from jointscope.graphs.fixed_lag.observation import AT_TICK, Observation
from jointscope.graphs.fixed_lag.sample_intake import SampleIntake
from jointscope.graphs.fixed_lag.status import EstimatorStatus, EventLog
from jointscope.graphs.fixed_lag.stream_watch import StreamWatch
from jointscope.graphs.fixed_lag.tick import Listener, Tick
from jointscope.graphs.fixed_lag.tick_engine import TickEngine
from jointscope.graphs.timeline import LONGEST_STEP, SHORTEST_STEP
from jointscope.robots.errors import EstimatorError
from jointscope.robots.robot import Robot

Array = NDArray[np.float64]

BIAS_WALK = 1e-5  # [rad/s/sqrt(s)] a gyro's bias moves by 1e-4 rad/s in 100 s
GAP = 0.3  # [s] without a tick after which the estimator begins anew
NEAR = 0.3  # share of the usual distance of commands below which a command makes no tick of its own
MOST_REFUSED = 50  # samples taken for glitches that may come back when a late command explains them
HELD_IN_DOUBT = 0.05  # [s] how long a wrong torque lasts where commands have stopped


class FixedLagEstimator:
    """State of a robot from the messages of its sensors, now and at the lag.

    Args:
        robot: calibrated; its noise, effects and priors of the biases are used.
        lag: length of the window over which the state is smoothed [s].
        adapt: parameters that may walk, by full name, and the density of their walk [unit/sqrt(s)].
        listener: called after each update.

    Attributes:
        robot: with every gyro predicted in full.
        status: counters, alarms.
        layout: of the robot's state.

    Raises:
        EstimatorError: impossible lag, or a parameter that cannot be adapted.
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
        self.robot = with_full_gyros(robot)
        self.layout, self.status, self._lag = self.robot.layout, EstimatorStatus(), lag
        self._adapt = _checked(self.robot, adapt or {})
        self._engine = TickEngine(self.robot, lag, self._adapt, BIAS_WALK)
        self._log, self._listener = EventLog(), listener
        self._intake = SampleIntake(self.robot, self.status, self._log)
        self._watch, self._consistency = StreamWatch(self.robot, self._log), Consistency()
        self._commands = CommandHistory(self.robot, lag)
        self._first: list[EncoderSample] = []
        self._pending: list[Observation] = []
        self._wanted: float | None = None  # stamp of a command whose tick is not closed yet
        self._late_command = math.inf  # stamp of the oldest late command
        self._refused: deque[Observation] = deque(maxlen=MOST_REFUSED)
        self._newest_sample = -math.inf

    @property
    def events(self) -> list:
        """What happened, oldest first; the last thousand."""
        return list(self._log.events)

    @property
    def lag(self) -> float:
        """Length of the window [s]."""
        return self._lag

    def command(self, t: float, u: ArrayLike) -> None:
        """A command that acts from t on.

        Args:
            t: stamp [s].
            u: shape (n,), SI unit of the robot's command.

        Raises:
            EstimatorError: wrong shape.
        """
        values = self._intake.command(t, u)
        if values is None:
            return
        self._watch.seen("command", t)
        if not self.status.running:
            self._commands.add(t, values)
            return
        self._close_before(t)
        self._commands.add(t, values)
        self.status.used["command"] += 1
        newest = self._engine.time if self._wanted is None else self._wanted
        if t < newest - AT_TICK:
            self._late_command = min(t, self._late_command)
            self.status.late["command"] += 1
        elif t - newest > min(NEAR * self._commands.period, LONGEST_STEP) or t - newest > LONGEST_STEP:
            self._wanted = t

    def encoder(self, t: float, q: ArrayLike) -> None:
        """Positions of all motors with stamp t [s], shape (n,) [rad]; channels that are NaN are left out."""
        self.sample(self.robot.motor_encoder.name, t, q)

    def gyro(self, name: str, t: float, w: ArrayLike) -> None:
        """Rate of a gyro with stamp t [s] in its own frame, shape (3,) [rad/s]."""
        self.sample(name, t, w)

    def sample(self, name: str, t: float, values: ArrayLike) -> None:
        """A message of any stream.

        Args:
            name: "command", or a sensor of the robot.
            t: stamp [s].
            values: shape (c,), SI.

        Raises:
            EstimatorError: unknown stream or wrong shape.
        """
        if name == "command":
            self.command(t, values)
            return
        observations = self._intake.sample(name, t, values)
        if not observations:
            return
        self._watch.seen(name, t)
        self._newest_sample = max(self._newest_sample, observations[0].taken)
        if not self.status.running:
            self._begin(observations)
            return
        self._close_before(observations[0].taken)
        if self.status.running:
            self._pending += observations

    def state(self, t: float | None = None) -> EstimatedState:
        """The robot's state with all that is known by now.

        Args:
            t: when [s]; the newest tick or sample if left out. Later times are predicted with the last command.
        """
        if not self.status.running:
            return self._unknown(t)
        self._catch_up(t)
        when = self._engine.time if t is None else max(t, self._engine.time)
        u = self._commands.mean(self._engine.time, when) if when > self._engine.time else np.zeros(self.robot.n)
        return self._state_of(when, self._engine.ahead(when, u))

    def smoothed(self, covariance: bool = True) -> EstimatedState | None:
        """The state at the lag, smoothed with everything since; None until the window is full.

        Args:
            covariance: whether it is wanted; it costs a millisecond.
        """
        if not self.status.running or self._engine.time - self._engine.past[0].time < 0.9 * self._lag:
            return None
        tick, mean, P = self._engine.smoothed(covariance)
        return self._state_of(tick.time, NewestState(mean, P))

    def newest_of_window(self) -> EstimatedState | None:
        """The newest tick as GTSAM's window has it; equal to `state()` up to rounding, and slower. None before start."""
        if not self.status.running:
            return None
        return self._state_of(self._engine.time, self._engine.from_window())

    def _begin(self, observations: list[Observation]) -> None:
        """Collects encoder samples until there is a first state."""
        encoder = self.robot.motor_encoder
        own = [o for o in observations if o.sensor == encoder.name]
        if sum(len(o.values) for o in own) < self.robot.n:
            return
        q = np.empty(self.robot.n)
        for o in own:
            q[o.channels] = o.values
        taken = own[0].taken
        if self._first and abs(taken - self._first[-1].time) > GAP:
            self._first.clear()
        if self._first and taken <= self._first[-1].time:
            return
        self._first.append(EncoderSample(taken, q - np.asarray(encoder.zero)))
        if is_enough(self._first):
            self._start()

    def _start(self) -> None:
        layout, before = self._engine.layout, self._engine.newest if self.status.restarts else None
        walks = np.array([_prior_sigma(self.robot, name) for name in layout.parameters])
        time, state = first_state(self.robot, layout, self._first, before, walks)
        self._engine.start(time, state)
        self._first.clear()
        self._pending.clear()
        self._refused.clear()
        self._wanted, self._late_command = None, math.inf
        self.status.running = True
        self._log.tell(time, "started", "estimator", f"states are estimated from {time:.3f} s on")

    def _close_before(self, t: float) -> None:
        """Closes all ticks that a message with stamp t shows to be complete."""
        if self._wanted is not None and t > self._wanted + AT_TICK:
            self._close(self._wanted)
        newest = self._engine.time if self._wanted is None else self._wanted
        if t - newest > GAP:
            self._restart(t, f"nothing came for {t - newest:.2f} s")
            return
        # commands that are slow or have stopped: ticks go on without them
        step = min(self._commands.period, LONGEST_STEP)
        while self.status.running and t - newest > 1.5 * LONGEST_STEP and self._wanted is None:
            newest = newest + step if t - newest > 2.0 * step else t - SHORTEST_STEP
            self._close(newest)

    def _catch_up(self, t: float | None) -> None:
        """Closes what is open at the time for which a state is wanted."""
        if self._wanted is not None and (t is None or self._wanted <= t + AT_TICK):
            self._close(self._wanted)
        if not self.status.running:
            return
        newest = max((o.taken for o in self._pending), default=-math.inf)
        if newest > self._engine.time + SHORTEST_STEP and (t is None or newest <= t + AT_TICK):
            self._close(newest)
        elif (self._pending and self._wanted is None) or self._late_command < math.inf:
            self._take_late_ones()

    def _close(self, time: float) -> None:
        """One update: late messages, the step to a new tick, its samples."""
        began = clock.perf_counter()
        innovations = self._take_late_ones()
        engine, now = self._engine, []
        if time > engine.time + AT_TICK:
            later = []
            for o in self._pending:
                (now if o.taken <= time + AT_TICK else later).append(o)
            self._pending = later
            u, doubt = self._acting(engine.time, time)
            innovations += engine.advance(time, u, doubt, now)
        if self._wanted is not None and time >= self._wanted - AT_TICK:
            self._wanted = None
        self._finish(innovations, now, clock.perf_counter() - began)

    def _take_late_ones(self) -> list[Innovation]:
        """Messages about times before the newest tick."""
        engine, found = self._engine, list[Innovation]()
        if self._late_command < math.inf:
            engine.correct_commands(self._late_command, self._acting)
            self._readmit(self._late_command)
            self._late_command = math.inf
        late = [o for o in self._pending if o.taken <= engine.time + AT_TICK]
        if late:
            self._pending = [o for o in self._pending if o.taken > engine.time + AT_TICK]
            oldest = engine.past[0].time
            inside = [o for o in late if o.taken >= oldest]
            for o in late:
                if o.taken < oldest:
                    self._intake.too_late(o, engine.time)
                elif o.taken < engine.time - AT_TICK:
                    self._intake.is_late(o, engine.time)
            if inside:
                found = engine.late(inside)
                self._count(inside, found)
        return found

    def _readmit(self, since: float) -> None:
        """Samples that were taken for glitches get another chance where the commands were not what they seemed."""
        for o in self._refused:
            if o.taken >= since:
                self._pending.append(o)
                self.status.dropped[o.sensor]["outlier"] -= 1
        self._refused.clear()

    def _finish(self, innovations: list[Innovation], used: list[Observation], seconds: float) -> None:
        """Counts, alarms, sanity, listener."""
        began = clock.perf_counter()
        engine, status = self._engine, self.status
        status.updates += 1
        self._count(used, innovations)
        for channel, mean_square, begins in self._consistency.add(innovations):
            self._tell_alarm(channel, mean_square, begins)
        status.nis_mean = self._consistency.nis_mean
        status.lost = self._watch.check(engine.time)
        if not self._is_sane(innovations):
            self._restart(engine.time, "the estimate contradicted the encoders for a tenth of a second")
            return
        if self._listener is not None:
            state = self._state_of(engine.time, engine.newest)
            seconds += clock.perf_counter() - began
            self._listener(Tick(state, tuple(innovations), seconds, self.smoothed))

    def _count(self, used: list[Observation], innovations: list[Innovation]) -> None:
        for o in used:
            self.status.used[o.sensor] += 1
        for innovation in innovations:
            if not innovation.used:
                self._intake.outlier(innovation)
                self._refuse(innovation, used)

    def _refuse(self, innovation: Innovation, used: list[Observation]) -> None:
        """Remembers the refused channels of a sample for a while."""
        names = self.robot.sensors[innovation.sensor].channels
        for o in used:
            if (o.sensor, o.stamp) == (innovation.sensor, innovation.time):
                mask = np.array([names[c] in innovation.channels for c in o.channels.tolist()])
                if mask.any():
                    self._refused.append(
                        replace(o, channels=o.channels[mask], values=o.values[mask], sigma=o.sigma[mask])
                    )

    def _tell_alarm(self, channel: str, mean_square: float, begins: bool) -> None:
        self.status.alarms = tuple(self._consistency.alarms)
        if begins:
            text = f"innovations of {channel} are {math.sqrt(mean_square):.1f} times as large as expected; diagnose says why"
        else:
            text = f"innovations of {channel} are as large as expected again"
        self._log.tell(self._engine.time, "alarm" if begins else "alarm_over", channel, text)

    def _is_sane(self, innovations: list[Innovation]) -> bool:
        finite = bool(np.isfinite(self._engine.newest.mean).all())
        return finite and self._watch.fits(self._engine.time, innovations)

    def _restart(self, t: float, reason: str) -> None:
        self.status.running, self.status.restarts = False, self.status.restarts + 1
        self._first.clear()
        self._pending.clear()
        self._refused.clear()
        self._wanted, self._late_command = None, math.inf
        self._log.tell(t, "restarted", "estimator", f"{reason}; the estimator begins anew, biases are kept")

    def _acting(self, t0: float, t1: float) -> tuple[Array, Array | None]:
        """Mean command over a step, and the standard deviation of the torques that missing commands leave open."""
        commands, gain = self._commands, np.abs(self._engine.torque_gain)
        u = commands.mean(t0, t1)
        if self._watch.command_is_lost(t1):
            # the drives may do anything between holding the last command and nothing
            wrong = gain * (np.abs(u) + commands.typical_change)
            return u, wrong * math.sqrt(HELD_IN_DOUBT / (t1 - t0))
        missing = commands.doubt(t0, t1)
        return (u, None) if missing is None else (u + missing[0], gain * missing[1])

    def _state_of(self, time: float, found: NewestState) -> EstimatedState:
        layout, P = self._engine.layout, found.covariance
        sigma = np.sqrt(np.maximum(P.diagonal(), 0.0))
        parameters = found.mean[layout.adapted].tolist(), sigma[layout.adapted].tolist()
        return EstimatedState(
            time=time,
            mean=found.mean[: layout.d],
            covariance=P[: layout.d, : layout.d],
            age=time - self._newest_sample,
            layout=self.layout,
            biases={name: found.mean[columns] for name, columns in layout.biases.items()},
            bias_sigmas={name: sigma[columns] for name, columns in layout.biases.items()},
            parameters=dict(zip(layout.parameters, zip(*parameters, strict=True), strict=True)),
        )

    def _unknown(self, t: float | None) -> EstimatedState:
        """What is known before there is a first state: the last encoder sample, if any."""
        mean, d = np.zeros(self.layout.size), self.layout.size
        if self._first:
            mean[self.layout.motor_q] = mean[self.layout.joint_q] = self._first[-1].q
        time = t if t is not None else max(self._newest_sample, 0.0)
        return EstimatedState(time, mean, np.diag(np.full(d, np.inf)), time - self._newest_sample, self.layout)


def _prior_sigma(robot: Robot, name: str) -> float:
    parameter = robot.parameters[name]
    return float(parameter.sigma if parameter.sigma is not None else parameter.prior_sigma)


def _checked(robot: Robot, adapt: Mapping[str, float]) -> dict[str, float]:
    for name, density in adapt.items():
        if name not in robot.parameters:
            raise EstimatorError(
                f"no parameter {name!r} to adapt; robot {robot.name!r} has {', '.join(robot.parameters)}"
            )
        if not (math.isfinite(density) and density > 0.0):
            raise EstimatorError(
                f"adapting {name} needs a positive density of its walk [unit/sqrt(s)]; got {density:g}"
            )
    return {name: float(density) for name, density in adapt.items()}
