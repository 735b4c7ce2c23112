# SPDX-License-Identifier: BSD-3-Clause
"""Motion of motors whose dry friction is a sign: they stick, or slip in one direction all through a step.

Rounded off, friction that stops a motor many times over in one step wants dozens of substeps, and lets a motor that
stands creep. As a sign it is constant while a motor slips, so that few steps of Runge-Kutta follow the motion; a motor
that stops stays where it is until more than its friction pulls at it. A step in which a motor turns round is cut there:
behind a jump of its command a light motor gains most of its speed within one step.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.comparison.runge_kutta import StepCuts, runge_kutta
from jointscope.robots.dynamics.rates_of_many import RatesOfMany
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

SIGN, NOTHING = 1e9, 1e-9  # [s/rad] sharpness of friction that is a sign, and of friction that is not there
SECANTS = 2  # by which the moment is found where a motor comes to rest: damped motors do not slow down evenly
CREEP = 1e-6  # [rad/s] a velocity that says no more than its direction


class StickSlip:
    """Steps of a robot all of whose motors stick and slip.

    Args:
        robot: the model with its present parameters.
        h: length of a step [s].
    """

    def __init__(self, robot: Robot, h: float):
        self._smooth, self._dry = RatesOfMany(robot, NOTHING), RatesOfMany(robot, SIGN)
        slippery = replace(robot, choices=replace(robot.choices, friction_sharpness=NOTHING))
        cuts = StepCuts(slippery, h)
        self._count = max(cuts.fine - 1, cuts.coarse)  # the last one would be for a change of sign
        self._q, self._v = robot.layout.q_motor, robot.layout.v_motor
        self._columns = np.arange(robot.layout.size)[self._v]

    def advance(self, x: Array, torque: Array, h: Array) -> Array:
        """States after steps of length h.

        Args:
            x: states, shape (s, d).
            torque: of the motors, shape (s, n) [N m].
            h: shape (s, 1) [s].
        """
        h = np.broadcast_to(h / self._count, (len(x), 1))
        for _ in range(self._count):
            x = self._one(x, torque, h, len(self._columns))
        return x

    def _one(self, x: Array, torque: Array, h: Array, turns: int) -> Array:
        """States after one step, which is cut where a motor turns round, so many times at the most."""
        after, direction = self._slipped(x, torque, h)
        before, v = x[:, self._v], after[:, self._v].copy()
        turned = (np.abs(before) > CREEP) & (v * direction < 0.0)
        after[:, self._v] = np.where(v * direction > 0.0, v, 0.0)
        cut = np.flatnonzero(np.any(turned, axis=1)) if turns else np.zeros(0, np.intp)
        if len(cut):
            share = np.where(turned[cut], before[cut] / np.where(turned[cut], before[cut] - v[cut], 1.0), 1.0)
            first = np.argmin(share, axis=1)
            until = np.take_along_axis(share, first[:, None], axis=1)
            rows, stops = np.arange(len(cut)), self._columns[first]
            at_rest, _ = self._slipped(x[cut], torque[cut], until * h[cut])
            for _ in range(SECANTS):
                began, left = x[cut, stops], at_rest[rows, stops]
                until = np.minimum(until * (began / (began - left))[:, None], 1.0)
                at_rest, _ = self._slipped(x[cut], torque[cut], until * h[cut])
            at_rest[rows, stops] = 0.0
            after[cut] = self._one(at_rest, torque[cut], (1.0 - until) * h[cut], turns - 1)
        return after

    def _slipped(self, x: Array, torque: Array, h: Array) -> tuple[Array, Array]:
        """States after a step, and where motors go in it, as `_at_beginning`; friction acts as if none turned round."""
        pull = self._smooth.of_motors(x, torque)
        direction, friction = self._at_beginning(x, pull)
        sticks = direction == 0.0
        friction = self._friction(self._halfway(x, pull + friction, h), direction)

        def rates(at: Array) -> Array:
            rate = self._smooth.rates(at, torque)
            rate[:, self._v] = np.where(sticks, 0.0, rate[:, self._v] + friction)
            rate[:, self._q] = np.where(sticks, 0.0, rate[:, self._q])
            return rate

        return runge_kutta(rates, x, h), direction

    def _at_beginning(self, x: Array, pull: Array) -> tuple[Array, Array]:
        """Where each motor goes, 1 or -1, or 0 where friction holds it, and the acceleration by friction, shape (s, n).

        Args:
            x: states, shape (s, d).
            pull: accelerations of the motors by everything else, shape (s, n).
        """
        v = x[:, self._v]
        stands = np.abs(v) <= CREEP
        wanted = np.where(stands, np.sign(pull), np.sign(v))
        friction = self._friction(x, wanted)
        return np.where(stands & (np.abs(pull) <= np.abs(friction)), 0.0, wanted), friction

    def _halfway(self, x: Array, acceleration: Array, h: Array) -> Array:
        """States of the middle of a step, as far as friction asks for them."""
        middle, layout = x.copy(), self._smooth.layout
        middle[:, layout.positions] += 0.5 * h * x[:, layout.velocities]
        middle[:, self._v] += 0.5 * h * acceleration
        return middle

    def _friction(self, x: Array, direction: Array) -> Array:
        """Acceleration of the motors by friction against a direction, shape (s, n)."""
        x = x.copy()
        x[:, self._v] = np.where(x[:, self._v] * direction > 0.0, x[:, self._v], CREEP * direction)
        return self._dry.by_friction(x) - self._smooth.by_friction(x)
