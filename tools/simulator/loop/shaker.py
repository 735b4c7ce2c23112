# SPDX-License-Identifier: BSD-3-Clause
"""A controller that holds a pose softly, swings slowly about it and adds multisines: what frequency responses need.

    torque = hold + stiff (target - q) + damp (v_target - v) + inertia a_target + excitation

with 2 Hz, critically damped for what each motor moves, so that the excitation is stronger than the controller at all
but the lowest lines. What it holds with is the weight in the pose.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.loop.controller import drive_gains, effort_limits, full_command
from jointscope.tools.simulator.loop.online_encoder import OnlineEncoder
from jointscope.tools.simulator.world.engine import TICK
from jointscope.tools.simulator.world.specification import transmission
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]
SERVO = 2.0 * np.pi * 2.0  # [rad/s] of the position controller, critically damped
DIFFERENCE = 20  # ticks between the angles of which a speed is made


class HeldPose:
    """What it takes to hold a robot in a pose, seen from its motors.

    Args:
        robot: with its true parameters.
        pose: angles of all joints, shape (n,) [rad or m].

    Attributes:
        motors: angles of the motors there, shape (n,).
        inertia: what each motor moves with the others standing, shape (n,) [kg m2 or kg].
        weight: torques that hold it, shape (n,) [N m or N].
        most: torques that the drives can give, shape (n,); infinite where the URDF does not say.
        dry: friction of each, shape (n,) [N m or N].
        gains: torque per unit of the command, shape (n,).
    """

    def __init__(self, robot: Robot, pose: Array):
        T = transmission(robot)
        rotors = np.array([robot.drive_parameter(joint, "inertia").value for joint in robot.joints])
        self.dry = np.array([robot.parameter(f"{joint}.coulomb_torque").value for joint in robot.joints])
        still = np.zeros((1, robot.n))
        self.motors = np.linalg.solve(T, pose)
        self.inertia = np.diagonal(T.T @ robot.tree.mass_matrix(pose[None])[0] @ T) + rotors
        self.weight = T.T @ robot.tree.torque(pose[None], still, still)[0]
        self.gains = np.abs(drive_gains(robot))
        by_volts = robot.command.unit in ("duty", "V")
        self.most = full_command(robot) * self.gains if by_volts else effort_limits(robot)
        short = next((i for i in range(robot.n) if abs(self.weight[i]) >= self.most[i]), None)
        if short is not None:
            raise SimulationError(
                f"{robot.joints[short]} of {robot.name} gives {self.most[short]:.3g} N m, and needs "
                f"{abs(self.weight[short]):.3g} N m to hold the pose {np.round(pose, 3).tolist()}; name another --pose"
            )

    @property
    def left(self) -> Array:
        """Torques that are left beside the weight, shape (n,)."""
        return np.asarray(self.most - np.abs(self.weight))


class Shaker:
    """Reads the encoders at every tick and remembers what it commanded, as `PController`.

    Args:
        held: the pose.
        torque: excitation of each tick, shape (ticks, n) [N m or N].
        swing: amplitude of the slow sine of each motor, shape (n,) [rad or m].
        speed: of it [rad/s].
        encoder: what it measures with.
    """

    def __init__(self, held: HeldPose, torque: Array, swing: Array, speed: float, encoder: OnlineEncoder):
        self.commands = np.zeros_like(torque)
        self._held, self._encoder, self._measured = held, encoder, np.zeros_like(torque)
        t = (TICK * np.arange(len(torque)))[:, None]
        wave, rate = swing * np.sin(speed * t), swing * speed * np.cos(speed * t)
        self._stiff, self._damp = held.inertia * SERVO**2, 2.0 * held.inertia * SERVO
        self._ahead = torque + held.weight - held.inertia * speed**2 * wave
        self._ahead += self._stiff * (held.motors + wave) + self._damp * rate

    def __call__(self, tick: int, past: Trajectory) -> Array:
        """The command of a tick, shape (n,), for what has happened until now."""
        q = self._measured[tick] = self._encoder.read(tick, past)
        before = max(0, tick - DIFFERENCE)
        v = (q - self._measured[before]) / (max(tick - before, 1) * TICK)
        held = self._held
        torque = self._ahead[tick] - self._stiff * q - self._damp * v
        self.commands[tick] = np.clip(torque, -held.most, held.most) / held.gains
        return self.commands[tick]
