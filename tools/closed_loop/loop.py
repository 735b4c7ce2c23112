# SPDX-License-Identifier: BSD-3-Clause
"""One closed loop: samples go to a source, its state to a law, the law's command to the robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.controllers.control_law import ControlLaw
from jointscope.tools.closed_loop.sources.state_source import StateSource
from jointscope.tools.simulator.loop.online_sensors import OnlineSensors
from jointscope.tools.simulator.world.engine import TICK
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]


class Loop:
    """A controller for `Engine.run` that remembers what it knew and did.

    Args:
        sensors: what arrives at each tick.
        source: makes a state of it.
        law: makes a command of the state.
        model: of source and law.
        ticks: how many there will be.

    Attributes:
        estimates: states as they were known, shape (ticks, d).
        commands: issued, shape (ticks, n_joints).
    """

    def __init__(self, sensors: OnlineSensors, source: StateSource, law: ControlLaw, model: Robot, ticks: int):
        self._sensors, self._source, self._law = sensors, source, law
        self.estimates, self.commands = np.zeros((ticks, model.layout.size)), np.zeros((ticks, model.n))

    def __call__(self, tick: int, past: Trajectory) -> Array:
        """The command of a tick, shape (n_joints,)."""
        now = tick * TICK
        for sample in self._sensors.arrived(now, past):
            self._source.take(sample)
        self.estimates[tick] = self._source.state(tick, now, past)
        self.commands[tick] = self._law.command(tick, self.estimates[tick])
        self._source.commanded(now, self.commands[tick])
        return self.commands[tick]
