# SPDX-License-Identifier: BSD-3-Clause
"""The motion of the estimator's whole state over a step: robot, walking biases, adapted parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.adaptation import Adaptation
from jointscope.graphs.fixed_lag.augmented_layout import AugmentedLayout
from jointscope.graphs.fixed_lag.newest_state import NewestState
from jointscope.graphs.fixed_lag.past_tick import PastStep, PastTick
from jointscope.graphs.fixed_lag.smoother_window import Rows
from jointscope.graphs.fixed_lag.step_noise import StepNoise
from jointscope.graphs.fixed_lag.tick_step import RatesAt, TickStep, take_step
from jointscope.robots.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prediction:
    """A step into the unknown.

    Attributes:
        state: at the end.
        F: transition, shape (D, D).
        T: whitens the defect of the robot's own state, shape (d, d).
        step: for the window.
    """

    state: NewestState
    F: Array
    T: Array
    step: PastStep


class ProcessModel:
    """Steps of one robot.

    Args:
        robot: model and noise.
        layout: of the estimator's state.
        adapt: density of the random walk of each adapted parameter, by full name [unit/sqrt(s)].
        bias_walk: density of the random walk of the gyro biases [rad/s/sqrt(s)].
    """

    def __init__(self, robot: Robot, layout: AugmentedLayout, adapt: Mapping[str, float], bias_walk: float):
        self.layout, self._rule = layout, robot.choices.integrator
        self._adaptation = Adaptation(robot, tuple(adapt))
        self._noise = StepNoise(robot)
        walk = [bias_walk] * (3 * len(layout.gyros)) + list(adapt.values())
        self._walk, self._ones = np.array(walk), np.ones(robot.n)
        self._walk_kept: tuple[float, tuple[Array, Array, Array, Array]] | None = None
        self._near: RatesAt | None = None

    @property
    def torque_gain(self) -> Array:
        """Torque of each motor per unit of its command, shape (n,) [N m / unit]."""
        return self._adaptation.model.command_torque(self._ones)

    def begins_near(self, rates: RatesAt | None) -> None:
        """Rates near the beginning of the next step; they save their evaluation. None if nothing is known."""
        self._near = rates

    def predicted(self, x0: NewestState, h: float, u: Array, doubt: Array | None) -> Prediction:
        """Where a step leads.

        Args:
            x0: state at the beginning.
            h: length [s].
            u: mean command, shape (n,).
            doubt: standard deviation of a further torque of each motor, shape (n,) [N m]; None for none.
        """
        layout = self.layout
        d, own = layout.d, x0.mean[: layout.d]
        if self._adaptation.follow(x0.mean[layout.adapted], np.sqrt(np.diag(x0.covariance)[layout.adapted])):
            self._near = None
        model = self._adaptation.model
        step = take_step(model, self._rule, own, model.command_torque(u), h, self._near)
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
        return Prediction(x0.predicted(mean, F, Q), F, T, PastStep(x0.mean, h, u, step, slopes, np.zeros(d)))

    def corrected(self, past: PastStep, u: Array, doubt: Array | None) -> Array:
        """Changes the mean command of a step, shape (n,); returns the whitening of its defect, shape (d, d)."""
        past.moved = past.moved + past.step.by_torque @ (self.torque_gain * (u - past.u))
        past.u = u
        return self._noise.of_step(past.start[: self.layout.d], past.h, self._extra(past.step, doubt))[0]

    def rows(self, before: PastTick, past: PastStep, T: Array) -> Rows:
        """Whitened rows of a step from a tick; T whitens its defect, shape (d, d)."""
        d, adapted = self.layout.d, self.layout.adapted
        A0, A1 = (part.copy() for part in self._walked(past.h)[2:])
        A0[:d, :d], A1[:d, :d] = T @ past.step.by_start, T @ past.step.by_end
        if self.layout.parameters:
            A0[:d, adapted] = -T @ past.by_parameters
        b = A0 @ (past.start - before.nominal)
        b[:d] += T @ past.moved
        return Rows((before.number, before.number + 1), (A0, A1), b)

    def _extra(self, step: TickStep, doubt: Array | None) -> Array | None:
        """Standard deviation of velocities and memories over a step from that of the motors' torques, shape (r,)."""
        if doubt is None:
            return None
        return np.asarray(np.sqrt(((step.by_torque[self.layout.robot.rates] * doubt) ** 2).sum(axis=1)))

    def _walked(self, h: float) -> tuple[Array, Array, Array, Array]:
        """Transition, covariance and rows of what walks over a step; the robot's own part is zero."""
        if self._walk_kept is None or self._walk_kept[0] != h:
            d, size, walk = self.layout.d, self.layout.size, self._walk * np.sqrt(h)
            F, (Q, A0, A1) = np.eye(size), np.zeros((3, size, size))
            own = np.arange(d, size)
            A0[own, own], A1[own, own], Q[own, own] = -1.0 / walk, 1.0 / walk, walk**2
            self._walk_kept = h, (F, Q, A0, A1)
        return self._walk_kept[1]
