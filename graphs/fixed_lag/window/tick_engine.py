# SPDX-License-Identifier: BSD-3-Clause
"""From one tick to the next: predict, hold samples against the prediction, hand the linear rows to the window.

A step and its samples are linearised once, at the best state known when they come; the nominal state of a tick is where
it was predicted. Samples that come late, and commands that come late, change rows of older ticks; the newest state is
then read from the window again.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.window.augmented_layout import AugmentedLayout
from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.graphs.fixed_lag.window.newest_state import NewestState
from jointscope.graphs.fixed_lag.window.observation import AT_TICK, Observation, ObservedRows, observed_rows
from jointscope.graphs.fixed_lag.window.past_tick import PastTick
from jointscope.graphs.fixed_lag.window.process_model import Prediction, ProcessModel
from jointscope.graphs.fixed_lag.window.sample_judge import SampleJudge
from jointscope.graphs.fixed_lag.window.smoother_window import Rows, SmootherWindow
from jointscope.graphs.fixed_lag.window.users_factor import rows_of, ticks_of
from jointscope.graphs.problem.timeline import LONGEST_STEP
from jointscope.robots.dynamics.spring_torques import torque_reading
from jointscope.robots.model.readings_at_one_state import ReadingsAtOneState
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

Acting = Callable[[float, float], tuple[Array, Array | None]]
WALKED_TOO_FAR = 6.0  # [sigma of the prior] a bias that is further away is not kept when the estimator begins anew
COMMITTED_TOGETHER = 4  # ticks that wait for iSAM2; the newest state does not need it


class TickEngine:
    """The estimate between the first tick and the newest.

    Args:
        robot: model, noise, sensors.
        lag: length of the window [s].
        adapt: density of the random walk of each adapted parameter, by full name [unit/sqrt(s)].
        bias_walk: density of the random walk of the gyro biases [rad/s/sqrt(s)].
    """

    def __init__(self, robot: Robot, lag: float, adapt: Mapping[str, float], bias_walk: float):
        self.layout = AugmentedLayout(robot.layout, tuple(s.name for s in robot.biased), tuple(adapt))
        self._lag, self._scale = lag, self.layout.scale(robot)
        self._bias_prior = (
            np.concatenate([np.zeros(0), *(s.bias for s in robot.biased)]),
            np.repeat([s.bias_prior_sigma for s in robot.biased], 3),
        )
        self._process = ProcessModel(robot, self.layout, adapt, bias_walk)
        self._readings = ReadingsAtOneState(robot, torque_reading(robot))
        self._judge = SampleJudge({name: sensor.channels for name, sensor in robot.sensors.items()})
        self.past: deque[PastTick] = deque()
        self._uncommitted: list[tuple[PastTick, int]] = []  # ticks and the places of their rows among the new factors
        self._waiting = 0  # ticks that are not in the window yet

    @property
    def time(self) -> float:
        """Of the newest tick [s]."""
        return self.past[-1].time

    @property
    def torque_gain(self) -> Array:
        """Torque of each motor per unit of its command, shape (n,) [N m / unit]."""
        return self._process.torque_gain

    @property
    def ran_away(self) -> bool:
        """Whether the newest step led farther than any robot moves."""
        return bool(np.isnan(self.newest.mean).any())

    @property
    def kept(self) -> NewestState | None:
        """The newest state if its biases are worth keeping: possible, and near what was known of them before."""
        found = getattr(self, "newest", None)
        if found is None or not found.is_possible:
            return None
        far = np.abs(found.mean[self.layout.d : self.layout.adapted.start] - self._bias_prior[0])
        return found if bool(np.all(far < WALKED_TOO_FAR * self._bias_prior[1])) else None

    def start(self, time: float, state: NewestState) -> None:
        """Begins with a Gaussian at a time."""
        self.newest, self.window = state, SmootherWindow(self._lag, self._scale)
        self.past.clear()
        self._uncommitted.clear()
        self._waiting = 0
        self._process.begins_near(None)
        self._judge.go_back_to({})
        self.past.append(PastTick(0, time, (), state.mean.copy(), state, np.zeros(len(self.torque_gain))))
        self.window.add_tick(0, time)
        root = np.linalg.inv(np.linalg.cholesky(state.covariance / np.outer(self._scale, self._scale))) / self._scale
        self.window.add_rows(Rows((0,), (root,), np.zeros(len(root))))
        self.window.commit()

    def advance(
        self, time: float, u: Array, doubt: Array | None, observations: Sequence[Observation]
    ) -> list[Innovation]:
        """Closes a new tick.

        Args:
            time: of the tick [s].
            u: mean command since the newest tick, shape (n,).
            doubt: standard deviation of a further torque of each motor over the step, shape (n,) [N m]; None for none.
            observations: taken in between or at the new tick.
        """
        before, x0 = self.past[-1], self.newest
        found = self._process.predicted(x0, time - before.time, u, doubt)
        here = PastTick(before.number + 1, time, tuple(observations), found.state.mean.copy(), found.state, u)
        self.window.add_tick(here.number, time)
        innovations = self._step(before, here, x0, found)
        self.past.append(here)
        self._waiting += 1
        if self._waiting >= COMMITTED_TOGETHER:
            self._commit()
        while self.past[0].time < time - self._lag:
            self.past.popleft()
        return innovations

    def late(self, observations: Sequence[Observation]) -> list[Innovation]:
        """Takes in samples that were taken at or before the newest tick; those before the window are left out."""
        self._commit()
        ticks = list(self.past)
        times = np.array([tick.time for tick in ticks])
        innovations: list[Innovation] = []
        for o in observations:
            i = int(np.searchsorted(times, o.taken - AT_TICK))
            first, last = ticks[max(i - 1, 0)], ticks[min(i, len(ticks) - 1)]
            feels = o.needs_step(self._readings)
            if feels and first is last:
                continue  # the step before it is gone
            at_tick = abs(last.time - o.taken) <= AT_TICK and not feels
            x1 = self._estimate(last)
            x0 = None if at_tick or first is last else self._estimate(first)
            seen = observed_rows(self._readings, self.layout, [o], x0, x1, (first.time, last.time), last.u)
            H = seen.by_end if seen.by_start is None else seen.by_end + seen.by_start
            S = H @ self.window.covariance(last.number) @ H.T
            S.flat[:: len(S) + 1] += seen.sigma**2
            keep, found = self._judge.judged([o], seen, S)
            innovations += found
            seen = seen.chosen(keep)
            if len(seen.residual):
                self.window.add_rows(self._sensor_rows(seen, first, last, x0, x1))
        self._reread()
        return innovations

    def add(self, factor: gtsam.NonlinearFactor) -> None:
        """A user's factor on ticks of the window; it stays in it, and the newest state is read from the window again.

        Raises:
            EstimatorError: keys that are not in the window, or a factor that cannot be linearised.
        """
        self._commit()
        ticks = ticks_of(factor, {tick.number: tick for tick in self.past})
        self.window.add_rows(rows_of(factor, ticks, self._estimate))
        self._reread()

    def correct_commands(self, since: float, acting: Acting) -> Counter[str]:
        """Commands have come late: steps that end after a time are taken anew, from the state where they began.

        A jump of the torque may let a motor start to slide, so nothing of these steps is kept: neither their
        linearization nor what was taken for a glitch.

        Args:
            since: stamp of the oldest of these commands [s].
            acting: gives mean command and doubt between two times, as `advance` takes them.

        Returns:
            By sensor, how many samples more are taken for glitches now.
        """
        self._commit()
        again = [(start, tick) for start, tick in itertools.pairwise(self.past) if tick.time > since]
        change = Counter[str]()
        if again:
            self._judge.go_back_to(again[0][0].far)
            self._process.begins_near(None)
            self.newest = again[0][0].filtered
        for start, tick in again:
            change.subtract(tick.glitches)
            for slot in tick.slots:
                self.window.remove(slot)
            tick.slots.clear()
            x0, h = self.newest, tick.time - start.time
            tick.u, doubt = acting(start.time, tick.time)
            self._step(start, tick, x0, self._process.predicted(x0, h, tick.u, doubt))
            change.update(tick.glitches)
        self._reread()
        return change

    def ahead(self, time: float, acting: Acting) -> NewestState:
        """The newest state, predicted to a later time; `acting` as in `correct_commands`. Nothing is kept."""
        state, begins = self.newest, self.time
        steps = max(math.ceil((time - begins) / LONGEST_STEP - 1e-6), 1) if time > begins else 0
        edges = [*(begins + (time - begins) * i / steps for i in range(steps)), time]
        for t0, t1 in itertools.pairwise(edges):
            state = self._process.predicted(state, t1 - t0, *acting(t0, t1)).state
        return state

    def smoothed(self, covariance: bool) -> tuple[float, NewestState]:
        """Time [s] and state of the oldest tick of the window; its covariance is NaN if not wanted."""
        self._commit()
        oldest = self.past[0]
        mean = self._estimate(oldest)
        P = self.window.covariance(oldest.number) if covariance else np.full((len(mean), len(mean)), np.nan)
        return oldest.time, NewestState(mean, P)

    def from_window(self) -> NewestState:
        """Mean and covariance of the newest tick as the window has them."""
        self._commit()
        newest = self.past[-1]
        return NewestState(self._estimate(newest), self.window.covariance(newest.number))

    def _step(self, before: PastTick, here: PastTick, x0: NewestState, found: Prediction) -> list[Innovation]:
        """Goes from one tick to the next, with the samples in between; the window is handed all rows."""
        self._process.begins_near(found.end)
        b = found.A0 @ (x0.mean - before.nominal) + found.A1 @ (found.state.mean - here.nominal)
        self._add(here, Rows((before.number, here.number), (found.A0, found.A1), b))
        innovations = self._take_in(x0, found, before, here) if here.observations else []
        here.filtered = self.newest = found.state
        here.glitches, here.far = tuple(i.sensor for i in innovations if not i.used), self._judge.memory
        return innovations

    def _take_in(self, x0: NewestState, found: Prediction, before: PastTick, here: PastTick) -> list[Innovation]:
        """Updates a prediction with samples of its step."""
        x1, time, observations = found.state, here.time, here.observations
        at_end = all(o.taken >= time - AT_TICK and not o.needs_step(self._readings) for o in observations)
        start = None if at_end else x0.mean
        seen = observed_rows(self._readings, self.layout, observations, start, x1.mean, (before.time, time), here.u)
        with_state = seen.by_end @ x1.covariance
        S = with_state @ seen.by_end.T
        if seen.by_start is not None:
            with_start = seen.by_start @ x0.covariance
            through = with_start @ found.F.T
            both = through @ seen.by_end.T
            S += both + both.T + with_start @ seen.by_start.T
            with_state = with_state + through
        S.flat[:: len(S) + 1] += seen.sigma**2
        keep, innovations = self._judge.judged(observations, seen, S)
        if not keep.all():
            seen, with_state, S = seen.chosen(keep), with_state[keep], S[np.ix_(keep, keep)]
        if len(seen.residual):
            self._add(here, self._sensor_rows(seen, before, here, x0.mean, x1.mean))
            x1.update(with_state, S, seen.residual)
        return innovations

    def _add(self, tick: PastTick, rows: Rows) -> None:
        """Rows of the step that led to a tick."""
        self._uncommitted.append((tick, self.window.add_rows(rows)))

    def _estimate(self, tick: PastTick) -> Array:
        return tick.nominal + self.window.deviation(tick.number)

    def _reread(self) -> None:
        self.newest = self.past[-1].filtered = self.from_window()
        self._process.begins_near(None)

    def _commit(self) -> None:
        """Brings the window up to date."""
        slots = self.window.commit()
        for tick, index in self._uncommitted:
            tick.slots.append(int(slots[index]))
        self._uncommitted.clear()
        self._waiting = 0

    def _sensor_rows(self, seen: ObservedRows, first: PastTick, last: PastTick, x0: Array | None, x1: Array) -> Rows:
        """Whitened rows of samples that were linearised at x0 and x1."""
        b = seen.residual + seen.by_end @ (x1 - last.nominal)
        weight = 1.0 / seen.sigma
        if seen.by_start is None or x0 is None:
            return Rows((last.number,), (seen.by_end * weight[:, None],), b * weight)
        b = b + seen.by_start @ (x0 - first.nominal)
        A = seen.by_start * weight[:, None], seen.by_end * weight[:, None]
        return Rows((first.number, last.number), A, b * weight)
