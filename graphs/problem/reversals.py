# SPDX-License-Identifier: BSD-3-Clause
"""Where dry friction turns over within a small part of a step.

Within such a step the collocation misses the friction's torque over up to a sixth of it. Its states, and those beside
it, are some sigmas off, and where a joint is light its inertia is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

SHARP_TURN = 4.0  # change of the argument of the friction's tanh, with its sign, over a step that is halved
HALVINGS = 5


def turns_sharply(v0: Array, v1: Array, sharpness: Array) -> NDArray[np.bool_]:
    """Whether velocities that dry friction acts against change their sign within a small part of a step.

    Args:
        v0: at the beginning of a step, shape (..., n) [rad/s].
        v1: at its end, shape (..., n) [rad/s].
        sharpness: k in tanh(k v), shape (n,) [s/rad].
    """
    return (v0 * v1 < 0.0) & (np.abs(v1 - v0) * sharpness > SHARP_TURN)


def times_of_reversals(robot: Robot, ticks: Array, x: Array) -> Array:
    """Ends of ever shorter steps around the moments at which dry friction turns over sharply, shape (k,) [s].

    Args:
        robot: its friction.
        ticks: shape (m + 1,) [s].
        x: states, shape (m + 1, d).
    """
    v = x[:, robot.layout.velocities_at(robot.choices.friction_velocity)]
    steps, joints = np.nonzero(turns_sharply(v[:-1], v[1:], robot.friction_sharpness()))
    share = v[steps, joints] / (v[steps, joints] - v[steps + 1, joints])
    found, low, high = [], np.zeros(len(steps)), np.ones(len(steps))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        found.append(ticks[steps] + middle * np.diff(ticks)[steps])
        low, high = np.where(share > middle, middle, low), np.where(share > middle, high, middle)
    return np.unique(found)
