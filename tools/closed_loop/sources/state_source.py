# SPDX-License-Identifier: BSD-3-Clause
"""The contract of a way of knowing the state: it takes samples as they arrive and says where the robot is now."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.simulator.loop.online_sensors import Sample
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]


class StateSource(Protocol):
    """Fed once per tick: samples, then the question, then the command that the controller made of the answer."""

    def take(self, sample: Sample) -> None:
        """A sample that has just arrived."""

    def state(self, tick: int, now: float, past: Trajectory) -> Array:
        """The present state in the layout of the model, shape (d,).

        Args:
            tick: its number.
            now: its time [s].
            past: the true trajectory; only the true state may look at it.
        """

    def commanded(self, now: float, command: Array) -> None:
        """The command that acts from now on, shape (n_joints,), SI unit of the command."""
