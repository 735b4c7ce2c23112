# SPDX-License-Identifier: BSD-3-Clause
"""The P-controller of the paper: u = clip(gain (target - measured motor angle), +-limit)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import motor_angles
from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.loop.motion import Motion
from jointscope.tools.simulator.loop.online_encoder import OnlineEncoder
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]

GAIN = 2.5  # [full command / rad]


class PController:
    """Reads the encoders at every tick and remembers what it commanded.

    Args:
        robot: for its command unit.
        motion: targets and limits.
        encoder: what it measures with.

    Attributes:
        commands: issued so far, shape (ticks, n_joints), in the unit of the robot's command.
    """

    def __init__(self, robot: Robot, motion: Motion, encoder: OnlineEncoder):
        self.commands = np.zeros_like(motion.targets)
        self._motion, self._encoder = motion, encoder
        self._targets = motor_angles(robot, motion.targets)
        self._full = full_command(robot)

    def __call__(self, tick: int, past: Trajectory) -> Array:
        """The command of a tick, shape (n_joints,), for what has happened until now."""
        motion, measured = self._motion, self._encoder.read(tick, past)
        self.commands[tick] = self._full * proportional(self._targets[tick] - measured, motion.limits[tick])
        return self.commands[tick]


def proportional(error: Array, limit: Array | float) -> Array:
    """The law: share of the full command for errors of motor angles, both of shape (n_joints,) [rad]."""
    return np.minimum(np.maximum(GAIN * error, -limit), limit)


def full_command(robot: Robot) -> Array:
    """The largest command of each joint, shape (n_joints,): duty 1, the supply voltage, or the URDF's effort limit.

    For currents, the one that gives that effort.

    Raises:
        SimulationError: it is not known.
    """
    if robot.command.unit == "duty":
        return np.ones(robot.n)
    if robot.command.unit == "V":
        if "motor.supply_voltage" not in robot.constants:
            raise SimulationError(f"robot {robot.name!r}: simulating needs the constant 'motor.supply_voltage'")
        return np.full(robot.n, robot.constants["motor.supply_voltage"])
    effort = effort_limits(robot)
    if not np.all(np.isfinite(effort)):
        raise SimulationError(f"robot {robot.name!r}: simulating needs an effort limit of every joint in the URDF")
    return effort / drive_gains(robot)


def effort_limits(robot: Robot) -> Array:
    """What the URDF says that each joint can give, shape (n_joints,) [N m or N]; infinite where it does not say."""
    effort = robot.tree.effort_limits
    return np.where((effort > 0.0) & (effort < 1e9), effort, np.inf)


def drive_gains(robot: Robot) -> Array:
    """Torque [N m] per unit of the command of each joint's drive at rest, shape (n_joints,)."""
    if robot.drive_gain is None:
        return np.ones(robot.n)
    gains = np.array([robot.drive_parameter(joint, robot.drive_gain).value for joint in robot.joints])
    return gains * robot.command_volts
