# SPDX-License-Identifier: BSD-3-Clause
"""The P-controller of the paper: u = clip(gain (target - measured motor angle), +-limit)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.robot import Robot
from jointscope.tools.simulator.effect import SimulatedEffect
from jointscope.tools.simulator.hooks import distort
from jointscope.tools.simulator.motion import Motion
from jointscope.tools.simulator.sensing import read_encoder

Array = NDArray[np.float64]

GAIN = 2.5  # [full command / rad]


class PController:
    """Reads the encoders at every tick and remembers what it commanded.

    Args:
        robot: for its command unit and encoders.
        motion: targets and limits.
        noise: of the encoders at the ticks, standard normal, shape (ticks, n_joints).
        quantized: whether the encoders have steps.
        effects: those that distort the encoders distort what the controller sees.

    Attributes:
        commands: issued so far, shape (ticks, n_joints), in the unit of the robot's command.
    """

    def __init__(self, robot: Robot, motion: Motion, noise: Array, quantized: bool, effects: Sequence[SimulatedEffect]):
        self.commands = np.zeros_like(motion.targets)
        self._encoder = robot.motor_encoder
        self._motion, self._noise, self._quantized = motion, noise, quantized
        self._effects = [effect for effect in effects if effect.uses("reading")]
        self._full = full_command(robot)

    def __call__(self, tick: int, q_motor: Array) -> Array:
        """The command of a tick, shape (n_joints,), for the angles that the encoders see, shape (n_joints,) [rad]."""
        motion, angles = self._motion, q_motor[None]
        if self._effects:
            angles = distort(self._effects, self._encoder, motion.times[tick : tick + 1], angles)
        # The encoder's known zero is subtracted again, so that targets are angles of the robot.
        measured = read_encoder(self._encoder, angles, self._noise[tick : tick + 1], self._quantized)[0]
        wanted = GAIN * (motion.targets[tick] - (measured - self._encoder.zero))
        limit = motion.limits[tick]
        self.commands[tick] = self._full * np.minimum(np.maximum(wanted, -limit), limit)
        return self.commands[tick]


def full_command(robot: Robot) -> Array:
    """The largest command of each joint, shape (n_joints,): duty 1, the supply voltage, or the URDF's effort limit.

    Raises:
        SimulationError: it is not known.
    """
    if robot.command.unit == "duty":
        return np.ones(robot.n)
    if robot.command.unit == "V":
        if "motor.supply_voltage" not in robot.constants:
            raise SimulationError(f"robot {robot.name!r}: simulating needs the constant 'motor.supply_voltage'")
        return np.full(robot.n, robot.constants["motor.supply_voltage"])
    effort = np.array(robot.tree.model.effortLimit, dtype=float)
    if not np.all(np.isfinite(effort) & (effort > 0) & (effort < 1e9)):
        raise SimulationError(f"robot {robot.name!r}: simulating needs an effort limit of every joint in the URDF")
    return effort
