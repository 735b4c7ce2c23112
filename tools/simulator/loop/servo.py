# SPDX-License-Identifier: BSD-3-Clause
"""A servo for robots with rigid joints: position over speed, gravity carried, within the limits of the URDF.

The P-controller of the paper needs the back-EMF of its motors for damping. A drive that is commanded in N m or A has
none, and an arm without springs under it falls; so this one closes a loop over the speed, too,

    v_wanted = clip(pace (target - q), +- share of the velocity limit)
    torque   = clip(gravity(q) + inertia / time (v_wanted - v), +- effort limit)

with the speed from differences of the measured angles. Its motion only has to excite the arm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.loop.controller import drive_gains, full_command
from jointscope.tools.simulator.loop.motion import Motion
from jointscope.tools.simulator.loop.online_encoder import OnlineEncoder
from jointscope.tools.simulator.world.engine import TICK
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]

PACE = 12.0  # [1/s] of the position loop
TIME = 0.02  # [s] of the speed loop
DIFFERENCE = 5  # ticks between the angles of which a speed is made
SHARE = 0.7  # of the velocity limit that is asked for
UNLIMITED = 3.0  # [rad/s or m/s] where the URDF allows any speed


class Servo:
    """Reads the encoders at every tick and remembers what it commanded, as `PController`.

    Args:
        robot: for its bodies, drives and limits.
        motion: targets and limits; a limit is a share of the speed.
        encoder: what it measures with.

    Attributes:
        commands: issued so far, shape (ticks, n_joints), in the unit of the robot's command.
    """

    def __init__(self, robot: Robot, motion: Motion, encoder: OnlineEncoder):
        self.commands = np.zeros_like(motion.targets)
        self._tree, self._motion, self._encoder = robot.tree, motion, encoder
        self._measured = np.zeros_like(motion.targets)
        self._full, self._gains = full_command(robot), drive_gains(robot)
        rotors = np.array([robot.drive_parameter(joint, "inertia").value for joint in robot.joints])
        self._inertia = np.diagonal(robot.tree.mass_matrix(motion.centre[None])[0]) + rotors
        speed = robot.tree.velocity_limits
        self._speed = SHARE * np.where(np.isfinite(speed) & (speed > 0.0) & (speed < 1e3), speed, UNLIMITED)

    def __call__(self, tick: int, past: Trajectory) -> Array:
        """The command of a tick, shape (n_joints,), for what has happened until now."""
        q = self._measured[tick] = self._encoder.read(tick, past)
        before = max(0, tick - DIFFERENCE)
        v = (q - self._measured[before]) / (max(tick - before, 1) * TICK)
        most = self._motion.limits[tick] * self._speed
        wanted = np.clip(PACE * (self._motion.targets[tick] - q), -most, most)
        torque = self._tree.torque(q[None], np.zeros((1, len(q))), np.zeros((1, len(q))))[0]
        torque += self._inertia / TIME * (wanted - v)
        self.commands[tick] = np.clip(torque / self._gains, -self._full, self._full)
        return self.commands[tick]
