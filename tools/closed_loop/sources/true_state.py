# SPDX-License-Identifier: BSD-3-Clause
"""(a) The true state, which only a simulator knows: the limit of what an estimator can give."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.loop.online_sensors import Sample
from jointscope.tools.simulator.world.engine import Engine
from jointscope.tools.simulator.world.specification import motor_joint
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]


class TrueState:
    """Reads the engine; coordinates of the model that the truth does not have are zero.

    Args:
        robot: the model, which says what is where in a state.
        engine: the truth.
    """

    def __init__(self, robot: Robot, engine: Engine):
        layout, names = robot.layout, engine.coordinates
        places = [(name, layout.links.index(name), layout.n_link + layout.links.index(name)) for name in layout.links]
        for i in layout.elastic_joints:
            places.append((motor_joint(robot.joints[i]), int(layout.motor_q[i]), int(layout.motor_v[i])))
        there = [(names.index(name), position, velocity) for name, position, velocity in places if name in names]
        self._coordinates, self._positions, self._velocities = np.array(there, dtype=np.intp).T
        self._size = layout.size

    def take(self, sample: Sample) -> None:
        """Needs none."""

    def state(self, tick: int, now: float, past: Trajectory) -> Array:
        """The true state of this moment, shape (d,)."""
        x = np.zeros(self._size)
        x[self._positions], x[self._velocities] = past.q[-1, self._coordinates], past.v[-1, self._coordinates]
        return x

    def commanded(self, now: float, command: Array) -> None:
        """Needs none."""
