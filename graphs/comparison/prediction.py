# SPDX-License-Identifier: BSD-3-Clause
"""Predicted motion: many starts advance side by side through the recorded commands, or one through all of them.

The paper's Euler step where the robot file says euler, else Runge-Kutta of order 4 with as many substeps as springs,
dampers and friction ask for. Motors whose friction would stop them many times over in one step stick and slip instead.
A step in which a spring meets the edge of its dead zone is cut: its damper comes in and goes out within microseconds.
Predictions share no code with the collocation that smoothed the states. A model that contradicts the recording may run
away: its states are then infinite or no numbers, without a word.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.comparison.runge_kutta import StepCuts, runge_kutta_from
from jointscope.graphs.comparison.stick_slip import StickSlip
from jointscope.graphs.problem.dead_zone_edges import PARTS, DeadZoneEdges
from jointscope.graphs.problem.standstill import only_stiff_motors
from jointscope.graphs.problem.timeline import Timeline
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.dynamics.rates_of_many import RatesOfMany
from jointscope.robots.model.encoder_plays import EncoderPlays
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
Rate = Callable[[Array], Array]


class Predictor:
    """Advances states by the model of one robot.

    Args:
        robot: the model.
        timeline: ticks and commands.
    """

    def __init__(self, robot: Robot, timeline: Timeline):
        h = float(np.median(timeline.h))
        self._dry = StickSlip(robot, h) if only_stiff_motors(robot, h) else None
        self._model = RatesOfMany(robot)
        self._euler = robot.choices.integrator == "euler"
        path = CommandPath(timeline.ticks, timeline.u, robot.effects, robot.joints, not robot.command_held)
        self._h, u = timeline.h, path.acting(robot.values)[0]
        self._u, self._torque = u, self._model.torque_of(u)
        self._cuts = StepCuts(robot, h)
        self._edges, self._plays = DeadZoneEdges.of(robot), EncoderPlays.of(robot)
        self._play_sizes = np.zeros(0) if self._plays is None else self._plays.sizes(robot.values)

    def advance(self, x: Array, step: NDArray[np.intp]) -> Array:
        """States one tick later, shape (s, d).

        Args:
            x: states, shape (s, d).
            step: step that each state takes, shape (s,).
        """
        h, torque = self._h[step][:, None], self._torque[step]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            after = self._whole(x, h, torque)
            if self._edges is not None and np.any(met := self._edges.met(x, after)):
                part, acting = x[met], torque[met]
                for _ in range(PARTS):
                    part = self._whole(part, h[met] / PARTS, acting)
                after[met] = part
            if self._plays is not None:
                after[:, self._plays.lags] = self._plays.after(x, after, self._play_sizes)
            return after

    def _whole(self, x: Array, h: Array, torque: Array) -> Array:
        """States after steps of length h, shape (s, 1), in which nothing happens all of a sudden but friction."""
        return self._rounded(x, h, torque) if self._dry is None else self._dry.advance(x, torque, h)

    def _rounded(self, x: Array, h: Array, torque: Array) -> Array:
        """The same with friction rounded off, as its law says."""
        cuts = self._cuts
        first = self._model.rates(x, torque)
        if self._euler:
            return x + h * first
        if cuts.fine == cuts.coarse:
            return _advanced(lambda at: self._model.rates(at, torque), x, first, h, cuts.coarse)
        fine, after = cuts.fine_ones(x, first, h), np.empty_like(x)
        for some, count in ((fine, cuts.fine), (~fine, cuts.coarse)):
            if np.any(some):
                acting = torque[some]
                rate = _with_torque(self._model.rates, acting)
                after[some] = _advanced(rate, x[some], first[some], h[some], count)
        return after

    def with_accelerations(self, x: Array, step: NDArray[np.intp]) -> Array:
        """States with the link accelerations that the equations of motion give behind them, shape (s, d + n_link).

        Args:
            x: states, shape (s, d).
            step: step whose command acts, shape (s,).
        """
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            rates = self._model.rates(x, self._torque[step])
        return np.hstack([x, rates[:, self._model.layout.v_link]])

    def with_commands(self, x: Array, step: NDArray[np.intp]) -> Array:
        """States with the acting command behind them, shape (s, d + n); arguments as of `with_accelerations`."""
        return np.hstack([x, self._u[step]])

    def paths(self, x: Array, start: NDArray[np.intp], steps: int) -> Iterator[tuple[NDArray[np.intp], Array, Array]]:
        """Steps, states before and after each of them, until `steps` are done or the recording ends.

        Args:
            x: states at the starts, shape (s, d).
            start: tick of each start, shape (s,).
            steps: number of ticks to go.
        """
        for i in range(steps):
            step = start + i
            if np.any(step >= len(self._h)):
                return
            after = self.advance(x, step)
            yield step, x, after
            x = after

    def path(self, x: Array) -> Array:
        """States at all ticks from the first one, shape (m + 1, d); no numbers where the model has run away.

        Args:
            x: state at the first tick, shape (d,).
        """
        path = np.full((len(self._h) + 1, len(x)), np.nan)
        path[0] = x
        for step, _, after in self.paths(x[None], np.zeros(1, np.intp), len(self._h)):
            if not np.all(np.isfinite(after)):
                break
            path[step[0] + 1] = after[0]
        return path


def _with_torque(rates: Callable[[Array, Array], Array], torque: Array) -> Rate:
    return lambda x: rates(x, torque)


def _advanced(rate: Rate, x: Array, first: Array, h: Array | float, count: int) -> Array:
    """States after h, in a number of equal steps; `first` is the rate where they begin."""
    h = h / count
    x = runge_kutta_from(first, rate, x, h)
    for _ in range(count - 1):
        x = runge_kutta_from(rate(x), rate, x, h)
    return x
