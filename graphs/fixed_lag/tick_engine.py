# SPDX-License-Identifier: BSD-3-Clause
"""From one tick to the next: predict, hold samples against the prediction, hand the linear rows to the window.

A step and its samples are linearised once, at the best state known when they come; the nominal state of a tick is where
it was predicted. Samples that come late, and commands that come late, change rows of older ticks; the newest state is
then read from the window again.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from jointscope.graphs.fixed_lag.adaptation import Adaptation
from jointscope.graphs.fixed_lag.augmented_layout import AugmentedLayout
from jointscope.graphs.fixed_lag.innovation import Innovation
from jointscope.graphs.fixed_lag.newest_state import NewestState
from jointscope.graphs.fixed_lag.observation import AT_TICK, Observation, ObservedRows, observed_rows
from jointscope.graphs.fixed_lag.outlier_gate import OutlierGate
from jointscope.graphs.fixed_lag.smoother_window import Rows, SmootherWindow
from jointscope.graphs.fixed_lag.step_noise import StepNoise
from jointscope.graphs.fixed_lag.tick_step import RatesAt, TickStep, take_step
from jointscope.robots.readings_at_one_state import ReadingsAtOneState
from jointscope.robots.robot import Robot

Array = NDArray[np.float64]

Acting = Callable[[float, float], tuple[Array, Array | None]]
COMMITTED_TOGETHER = 5  # ticks that wait for iSAM2; the newest state does not need it


@dataclass
class PastStep:
    """A step that may be weighed anew when commands come late.

    Attributes:
        start: state in which it was linearised, shape (D,).
        h: length [s].
        u: mean command, shape (n,).
        step: its linearization.
        by_parameters: change of its end per adapted parameter, before the dynamics of the end, shape (d, p).
        moved: how the defect has changed by other commands since, shape (d,).
    """

    start: Array
    h: float
    u: Array
    step: TickStep
    by_parameters: Array
    moved: Array


@dataclass
class PastTick:
    """A tick in the window.

    Attributes:
        number: of the tick.
        time: [s].
        nominal: state from which deviations count, shape (D,).
        slot: of the factor of the step that led here; -1 for the first tick.
        step: that led here; None for the first tick.
    """

    number: int
    time: float
    nominal: Array
    slot: int = -1
    step: PastStep | None = None


class TickEngine:
    """The estimate between the first tick and the newest.

    Args:
        robot: model, noise, sensors.
        lag: length of the window [s].
        adapt: density of the random walk of each adapted parameter, by full name [unit/sqrt(s)].
        bias_walk: density of the random walk of the gyro biases [rad/s/sqrt(s)].
    """

    def __init__(self, robot: Robot, lag: float, adapt: Mapping[str, float], bias_walk: float):
        self.layout = AugmentedLayout(robot.layout, tuple(g.name for g in robot.gyros), tuple(adapt))
        self._lag, self._rule = lag, robot.choices.integrator
        self._channels = {name: sensor.channels for name, sensor in robot.sensors.items()}
        self._scale = self.layout.scale(robot)
        self._adaptation = Adaptation(robot, tuple(adapt))
        self._readings = ReadingsAtOneState(robot)
        self._noise = StepNoise(robot, self._adaptation.model)
        walk = [bias_walk] * (3 * len(self.layout.gyros)) + list(adapt.values())
        self._walk, self._ones = np.array(walk), np.ones(robot.n)
        self._walk_kept: tuple[float, tuple[Array, Array, Array, Array]] | None = None
        self._gate = OutlierGate()
        self.past: deque[PastTick] = deque()
        self._uncommitted: list[tuple[PastTick, int]] = []  # and the place of each step among the new factors
        self._rates: RatesAt | None = None  # near the newest state

    @property
    def time(self) -> float:
        """Of the newest tick [s]."""
        return self.past[-1].time

    @property
    def torque_gain(self) -> Array:
        """Torque of each motor per unit of its command, shape (n,) [N m / unit]."""
        return self._adaptation.model.command_torque(self._ones)

    def start(self, time: float, state: NewestState) -> None:
        """Begins with a Gaussian at a time."""
        self.newest, self.window = state, SmootherWindow(self._lag, self._scale)
        self.past.clear()
        self._uncommitted.clear()
        self._rates = None
        self.past.append(PastTick(0, time, state.mean.copy()))
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
        predicted, step, T = self._predicted(time, u, doubt)
        self._rates = step.step.end
        here = PastTick(before.number + 1, time, predicted.mean.copy(), -1, step)
        rows = self._step_rows(before, step, T)
        self.window.add_tick(here.number, time)
        first_row = self.window.add_rows(rows)
        innovations: list[Innovation] = []
        if observations:
            start = None if all(o.taken >= time - AT_TICK for o in observations) else x0.mean
            seen = observed_rows(
                self._readings, self.layout, observations, start, predicted.mean, before.time, time
            )
            F = self._transition
            gain_rows, S = seen.by_end @ predicted.covariance, None
            if seen.by_start is not None:
                cross = seen.by_start @ x0.covariance
                middle = cross @ F.T
                both = middle @ seen.by_end.T
                S = gain_rows @ seen.by_end.T + both + both.T + cross @ seen.by_start.T
                gain_rows = gain_rows + middle
            else:
                S = gain_rows @ seen.by_end.T
            S.flat[:: len(S) + 1] += seen.sigma**2
            keep, innovations = self._judged(observations, seen, S)
            if not keep.all():
                seen, gain_rows, S = seen.chosen(keep), gain_rows[keep], S[np.ix_(keep, keep)]
            if len(seen.residual):
                self.window.add_rows(self._sensor_rows(seen, before, here, x0.mean, predicted.mean))
                predicted.update(gain_rows, S, seen.residual)
        self.newest = predicted
        self.past.append(here)
        self._uncommitted.append((here, first_row))
        if len(self._uncommitted) >= COMMITTED_TOGETHER:
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
            at_tick = abs(last.time - o.taken) <= AT_TICK
            x1 = self._estimate(last)
            x0 = None if at_tick or first is last else self._estimate(first)
            seen = observed_rows(self._readings, self.layout, [o], x0, x1, first.time, last.time)
            H = seen.by_end if seen.by_start is None else seen.by_end + seen.by_start
            S = H @ self.window.covariance(last.number) @ H.T
            S.flat[:: len(S) + 1] += seen.sigma**2
            keep, found = self._judged([o], seen, S)
            innovations += found
            seen = seen.chosen(keep)
            if len(seen.residual):
                self.window.add_rows(self._sensor_rows(seen, first, last, x0, x1))
        self._reread()
        return innovations

    def correct_commands(self, since: float, acting: Acting) -> None:
        """Commands have come late: steps that end after a time get other torques and other doubts.

        Args:
            since: stamp of the oldest of these commands [s].
            acting: gives mean command and doubt between two times, as `advance` takes them.
        """
        self._commit()
        for start, tick in itertools.pairwise(self.past):
            if tick.time > since and tick.step is not None:
                step = tick.step
                u, doubt = acting(start.time, tick.time)
                step.moved = step.moved + step.step.by_torque @ (self.torque_gain * (u - step.u))
                step.u = u
                T = self._noise.of_step(step.start[: self.layout.d], step.h, self._extra(step.step, doubt))[0]
                self.window.remove(tick.slot)
                self._uncommitted.append((tick, self.window.add_rows(self._step_rows(start, step, T))))
        self._reread()

    def ahead(self, time: float, u: Array) -> NewestState:
        """The newest state, predicted to a later time with a mean command, shape (n,); nothing is kept."""
        if time <= self.time:
            return self.newest
        return self._predicted(time, u, None)[0]

    def smoothed(self, covariance: bool) -> tuple[PastTick, Array, Array]:
        """The oldest tick of the window, its mean, shape (D,), and covariance, shape (D, D); NaN if not wanted."""
        self._commit()
        oldest = self.past[0]
        mean = self._estimate(oldest)
        P = self.window.covariance(oldest.number) if covariance else np.full((len(mean), len(mean)), np.nan)
        return oldest, mean, P

    def from_window(self) -> NewestState:
        """Mean and covariance of the newest tick as the window has them."""
        self._commit()
        newest = self.past[-1]
        return NewestState(self._estimate(newest), self.window.covariance(newest.number))

    def _estimate(self, tick: PastTick) -> Array:
        return tick.nominal + self.window.deviation(tick.number)

    def _reread(self) -> None:
        self._commit()
        self.newest = self.from_window()

    def _commit(self) -> None:
        """Brings the window up to date."""
        slots = self.window.commit()
        for tick, index in self._uncommitted:
            tick.slot = int(slots[index])
        self._uncommitted.clear()

    def _predicted(self, time: float, u: Array, doubt: Array | None) -> tuple[NewestState, PastStep, Array]:
        """The state to which a step from the newest one leads, the step, and the whitening of its defect."""
        layout, before, x0 = self.layout, self.past[-1], self.newest
        d, h, own = layout.d, time - before.time, x0.mean[: layout.d]
        if self._adaptation.follow(x0.mean[layout.adapted], np.sqrt(np.diag(x0.covariance)[layout.adapted])):
            self._rates = None
        model = self._adaptation.model
        step = take_step(model, self._rule, own, model.command_torque(u), h, self._rates)
        T, G = self._noise.of_step(own, h, self._extra(step, doubt))
        F, Q = (part.copy() for part in self._walked(h)[:2])
        F[:d, :d] = step.transition
        spread = step.by_end_inverse @ G
        Q[:d, :d] = spread @ spread.T
        mean, slopes = x0.mean.copy(), np.zeros((d, 0))
        mean[:d] = step.x1
        if layout.parameters:
            slopes = h * self._adaptation.slopes(own, u)
            F[:d, layout.adapted] = step.by_end_inverse @ slopes
            mean[:d] += F[:d, layout.adapted] @ (x0.mean[layout.adapted] - self._adaptation.at)
        self._transition = F
        return x0.predicted(mean, F, Q), PastStep(x0.mean, h, u, step, slopes, np.zeros(d)), T

    def _extra(self, step: TickStep, doubt: Array | None) -> Array | None:
        """Standard deviation of velocities and memories over a step from that of the motors' torques, shape (r,)."""
        if doubt is None:
            return None
        return np.asarray(np.sqrt(((step.by_torque[self.layout.robot.rates] * doubt) ** 2).sum(axis=1)))

    def _step_rows(self, before: PastTick, past: PastStep, T: Array) -> Rows:
        """Whitened rows of a step from a tick."""
        d, adapted = self.layout.d, self.layout.adapted
        A0, A1 = (part.copy() for part in self._walked(past.h)[2:])
        A0[:d, :d], A1[:d, :d] = T @ past.step.by_start, T @ past.step.by_end
        if self.layout.parameters:
            A0[:d, adapted] = -T @ past.by_parameters
        b = A0 @ (past.start - before.nominal)
        b[:d] += T @ past.moved
        return Rows((before.number, before.number + 1), (A0, A1), b)

    def _walked(self, h: float) -> tuple[Array, Array, Array, Array]:
        """Transition, covariance and rows of what walks over a step; the robot's own part is zero."""
        if self._walk_kept is None or self._walk_kept[0] != h:
            d, size, walk = self.layout.d, self.layout.size, self._walk * np.sqrt(h)
            F, (Q, A0, A1) = np.eye(size), np.zeros((3, size, size))
            own = np.arange(d, size)
            A0[own, own], A1[own, own], Q[own, own] = -1.0 / walk, 1.0 / walk, walk**2
            self._walk_kept = h, (F, Q, A0, A1)
        return self._walk_kept[1]

    def _sensor_rows(
        self, seen: ObservedRows, first: PastTick, last: PastTick, x0: Array | None, x1: Array
    ) -> Rows:
        """Whitened rows of samples that were linearised at x0 and x1."""
        b = seen.residual + seen.by_end @ (x1 - last.nominal)
        weight = 1.0 / seen.sigma
        if seen.by_start is None or x0 is None:
            return Rows((last.number,), (seen.by_end * weight[:, None],), b * weight)
        b = b + seen.by_start @ (x0 - first.nominal)
        A = seen.by_start * weight[:, None], seen.by_end * weight[:, None]
        return Rows((first.number, last.number), A, b * weight)

    def _judged(
        self, observations: Sequence[Observation], seen: ObservedRows, S: Array
    ) -> tuple[NDArray[np.bool_], list[Innovation]]:
        """Rows to use, and the innovations of all samples."""
        sigma = np.sqrt(S.diagonal())
        keep = self._gate.believed(observations, seen.residual, sigma)
        innovations = []
        whole = bool(keep.all())
        for o, part in zip(observations, seen.parts, strict=True):
            if whole:
                own = S[part, part]
                innovations.append(self._innovation(o, o.channels, seen.residual[part], own, sigma[part], True))
                continue
            good = keep[part]
            for chosen, used in ((good, True), (~good, False)):
                if chosen.any():
                    rows = np.arange(part.start, part.stop)[chosen]
                    own = S[np.ix_(rows, rows)]
                    found = self._innovation(o, o.channels[chosen], seen.residual[rows], own, sigma[rows], used)
                    innovations.append(found)
        return keep, innovations

    def _innovation(
        self, o: Observation, channels: NDArray[np.intp], residual: Array, own: Array, sigma: Array, used: bool
    ) -> Innovation:
        nis = float(residual @ lapack.dposv(own, residual)[1])
        names = self._channels[o.sensor]
        if len(channels) < len(names):
            names = tuple(names[c] for c in channels.tolist())
        return Innovation(o.sensor, o.stamp, names, residual, sigma, nis, len(residual), used)
