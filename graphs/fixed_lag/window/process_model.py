# SPDX-License-Identifier: BSD-3-Clause
"""The motion of the estimator's whole state over a step: robot, walking biases, adapted parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.window.adaptation import Adaptation
from jointscope.graphs.fixed_lag.window.augmented_layout import AugmentedLayout
from jointscope.graphs.fixed_lag.window.newest_state import NewestState
from jointscope.graphs.fixed_lag.window.step_noise import StepNoise
from jointscope.graphs.fixed_lag.window.tick_step import RatesAt, TickStep, take_step
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

ACCELERATION_WALK = 1e-4  # [m/s^2/sqrt(s)] the bias of an accelerometer moves by 1e-3 m/s^2 in 100 s


@dataclass(frozen=True)
class Prediction:
    """A step into the unknown.

    Attributes:
        state: at the end.
        F: transition, shape (D, D).
        A0: whitened rows of the step by its beginning, shape (D, D).
        A1: by its end.
        end: rates of the robot near the end; None where they are not known.
    """

    state: NewestState
    F: Array
    A0: Array
    A1: Array
    end: RatesAt | None


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
        self._random = np.zeros(layout.size)  # density of the random torques in each velocity
        self._random[robot.layout.velocities] = np.concatenate([robot.noise.link_velocity, robot.noise.motor_velocity])
        walk = [bias_walk] * (3 * len(robot.gyros)) + [ACCELERATION_WALK] * (3 * len(robot.accelerometers))
        walk += list(adapt.values())
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
        rubbing = model.friction_columns
        self._adaptation.know_velocities(
            np.sqrt(np.diag(x0.covariance)[rubbing] + 0.5 * h * self._random[rubbing] ** 2)
        )
        step = take_step(model, self._rule, own, model.command_torque(u), h, self._near)
        T, G = self._noise.of_step(own, h, self._extra(step, doubt))
        F, Q, A0, A1 = (part.copy() for part in self._walked(h))
        F[:d, :d] = step.transition
        A0[:d, :d], A1[:d, :d] = T @ step.by_start, T @ step.by_end
        spread = step.by_end_inverse @ G
        Q[:d, :d] = spread @ spread.T
        mean = x0.mean.copy()
        mean[:d] = step.x1
        if layout.parameters:
            slopes = h * self._adaptation.slopes(own, u)
            A0[:d, layout.adapted] = -T @ slopes
            F[:d, layout.adapted] = step.by_end_inverse @ slopes
            mean[:d] += F[:d, layout.adapted] @ (x0.mean[layout.adapted] - self._adaptation.at)
        return Prediction(x0.predicted(mean, F, Q), F, A0, A1, step.end)

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
