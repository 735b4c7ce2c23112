# SPDX-License-Identifier: BSD-3-Clause
"""State feedback for elastic joints: u = clip(u_ref - gain (x - x_ref)), all of it from the robot file's model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.planning.optimal_gains import OptimalGains
from jointscope.tools.closed_loop.planning.reference import Reference
from jointscope.tools.simulator.loop.controller import full_command

Array = NDArray[np.float64]


class StateFeedback:
    """Feedforward along the plan, and the linear-quadratic regulator about it.

    Args:
        robot: the model.
        reference: its states and commands on the plan.
        step: between ticks [s].
    """

    def __init__(self, robot: Robot, reference: Reference, step: float):
        self._full = full_command(robot)
        self._reference, self._gains = reference, OptimalGains(robot, reference, step, self._full)

    def command(self, tick: int, x: Array) -> Array:
        """The command of a tick, shape (n_joints,)."""
        reference = self._reference
        wanted = reference.u[tick] - self._gains.at(tick) @ (x - reference.x[tick])
        return np.clip(wanted, -self._full, self._full)
