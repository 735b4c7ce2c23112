# SPDX-License-Identifier: BSD-3-Clause
"""Compensation of dry friction by one automaton per motor, which keeps it from chattering (BioRob, sec. 3, fig. 3).

    rest       |v| <= eps        torque = s sat1(e / eps_e)          towards the planned angle
    near       |e| <= eps_e      torque = s sat1(v / delta)
    forwards                     torque = s sat2(v / delta)          until v < -delta
    backwards                    torque = s sat3(v / delta)          until v > delta

with e = planned - present angle of the motor, v its velocity, s > 0 its friction in this posture.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REST, NEAR, FORWARDS, BACKWARDS = range(4)


class FrictionAutomaton:
    """The automata of all motors.

    Args:
        rest: velocity below which a motor rests, eps, shape (n,) [rad/s].
        near: error below which a motor is where it should be, eps_e, shape (n,) [rad].
        turn: velocity at which the direction is sure, delta > eps, shape (n,) [rad/s].
    """

    def __init__(self, rest: Array, near: Array, turn: Array):
        self._rest, self._near, self._turn = rest, near, turn
        self.states = np.full(len(rest), REST)

    def torque(self, error: Array, velocity: Array, friction: Array) -> Array:
        """The additional torque of the motors, eq. (21) to (27), shape (n,) [N m].

        Args:
            error: planned - present angle, shape (n,) [rad].
            velocity: present, shape (n,) [rad/s].
            friction: largest friction, shape (n,) [N m].
        """
        forwards = np.where(error > 0.0, FORWARDS, BACKWARDS)
        begun = np.where(np.abs(error) <= self._near, NEAR, forwards)
        state = np.where(self.states == REST, begun, self.states)
        state = np.where((state == FORWARDS) & (velocity < -self._turn), BACKWARDS, state)
        state = np.where((state == BACKWARDS) & (velocity > self._turn), FORWARDS, state)
        self.states = np.where(np.abs(velocity) <= self._rest, REST, state)
        x = velocity / self._turn
        shares = (_sat(error / self._near), _sat(x), _sat(2.0 * x + 1.0), _sat(2.0 * x - 1.0))
        return friction * np.choose(self.states, shares)


def _sat(x: Array) -> Array:
    return np.clip(x, -1.0, 1.0)
