# SPDX-License-Identifier: BSD-3-Clause
"""The paper's P-controller: u = clip(gain (planned link angle - motor angle)); it knows no model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import motor_angles
from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.planning.plan import Plan
from jointscope.tools.simulator.loop.controller import full_command, proportional

Array = NDArray[np.float64]


class ProportionalControl:
    """The law of `PController`, with the full command as its limit.

    Args:
        robot: the model.
        plan: its link angles are the targets.
    """

    def __init__(self, robot: Robot, plan: Plan):
        self._targets, self._motors, self._full = motor_angles(robot, plan.q), robot.layout.motor_q, full_command(robot)

    def command(self, tick: int, x: Array) -> Array:
        """The command of a tick, shape (n_joints,)."""
        return self._full * proportional(self._targets[tick] - x[self._motors], 1.0)
