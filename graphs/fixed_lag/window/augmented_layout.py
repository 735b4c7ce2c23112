# SPDX-License-Identifier: BSD-3-Clause
"""The estimator's own state: that of the robot, biases of gyros and accelerometers, and the parameters that it adapts.

Biases and adapted parameters walk at random, so none of them is shared by all ticks: a hub would have to be eliminated
anew at every update.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.encoder_plays import EncoderPlays
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]

POSITION, VELOCITY, BIAS = 1e-4, 1e-2, 1e-3  # [rad], [rad/s], [rad/s] units in which deviations are of size one
ACCELERATION_BIAS = 1e-2  # [m/s^2]


@dataclass(frozen=True)
class AugmentedLayout:
    """Where everything is.

    Attributes:
        robot: layout of the robot's own state, which comes first.
        biased: names of gyros and accelerometers, in the order of their biases.
        parameters: full names of the adapted parameters.
    """

    robot: StateLayout
    biased: tuple[str, ...]
    parameters: tuple[str, ...]

    @cached_property
    def d(self) -> int:
        """Size of the robot's own state."""
        return self.robot.size

    @cached_property
    def size(self) -> int:
        """Size D of the whole."""
        return self.d + 3 * len(self.biased) + len(self.parameters)

    @cached_property
    def biases(self) -> Mapping[str, slice]:
        """Columns of the bias of each sensor that has one."""
        return {name: slice(self.d + 3 * i, self.d + 3 * i + 3) for i, name in enumerate(self.biased)}

    @cached_property
    def adapted(self) -> slice:
        """Columns of the adapted parameters."""
        return slice(self.d + 3 * len(self.biased), self.size)

    @cached_property
    def walking(self) -> slice:
        """Columns of everything that walks: biases and parameters."""
        return slice(self.d, self.size)

    def scale(self, robot: Robot) -> Array:
        """Units in which deviations of the components are of size one, shape (D,)."""
        scale = np.ones(self.size)
        scale[self.robot.positions], scale[self.robot.velocities] = POSITION, VELOCITY
        plays = EncoderPlays.of(robot)
        if plays is not None:
            scale[plays.lags] = POSITION
        accelerometers = {sensor.name for sensor in robot.accelerometers}
        for name in self.biased:
            scale[self.biases[name]] = ACCELERATION_BIAS if name in accelerometers else BIAS
        scale[self.adapted] = [0.01 * max(abs(robot.parameters[name].value), 1e-3) for name in self.parameters]
        return scale
