# SPDX-License-Identifier: BSD-3-Clause
"""Predicted motion: many starts advance side by side through the recorded commands.

The paper's Euler step where the robot file says euler, else Runge-Kutta of order 4 with as many substeps as the
stiffest friction asks for. Predictions share no code with the collocation that smoothed the states.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.runge_kutta import runge_kutta, stable_substeps
from jointscope.graphs.timeline import Timeline
from jointscope.robots.command_path import CommandPath
from jointscope.robots.elastic_joints import ElasticJoints
from jointscope.robots.robot import Robot

Array = NDArray[np.float64]


class Predictor:
    """Advances states by the model of one robot.

    Args:
        robot: the model.
        timeline: ticks and commands.
    """

    def __init__(self, robot: Robot, timeline: Timeline):
        self._model = ElasticJoints(robot)
        self._values = np.array([robot.parameters[name].value for name in self._model.names])
        self._euler = robot.choices.integrator == "euler"
        path = CommandPath(timeline.ticks, timeline.u, robot.effects, robot.joints)
        self._h, self._u = timeline.h, path.acting({name: p.value for name, p in robot.parameters.items()})[0]
        self._substeps = stable_substeps(robot, float(np.median(self._h)))

    def advance(self, x: Array, step: NDArray[np.intp]) -> Array:
        """States one tick later, shape (s, d).

        Args:
            x: states, shape (s, d).
            step: step that each state takes, shape (s,).
        """
        h, u = self._h[step][:, None], self._u[step]
        if self._euler:
            return x + h * self._rate(x, u)
        h = h / self._substeps
        for _ in range(self._substeps):
            x = runge_kutta(lambda at: self._rate(at, u), x, h)
        return x

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

    def _rate(self, x: Array, u: Array) -> Array:
        layout, rate = self._model.layout, np.empty_like(x)
        rate[:, layout.positions] = x[:, layout.velocities]
        rate[:, layout.rates] = self._model.accelerations(x, u, self._values)
        return rate
