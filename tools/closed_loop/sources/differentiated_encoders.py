# SPDX-License-Identifier: BSD-3-Clause
"""(c) What is done without an estimator: encoders, their differences behind a low-pass, links where the plan has them.

    q_motor = the last reading
    v_motor = difference of the last two readings over the time between their stamps, behind a low-pass of first order
    q_link  = q_motor - planned stretch of the spring, and v_link likewise; hinges of bearings as planned;
              where links have encoders, these

Taking the link to be where the motor is would charge the encoders with the stretch that anyone with a model can plan.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Encoder
from jointscope.tools.closed_loop.planning.reference import Reference
from jointscope.tools.simulator.loop.online_sensors import Sample
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]

CUTOFF = 40.0  # [Hz]


class DifferentiatedEncoders:
    """Encoders only.

    Args:
        robot: the model.
        reference: its states on the plan, for the stretch of the springs.
        cutoff: of the low-pass [Hz].
    """

    def __init__(self, robot: Robot, reference: Reference, cutoff: float = CUTOFF):
        self._robot = robot
        self._layout, self._reference = robot.layout, reference
        self._motors = _Differences(robot.motor_encoder, reference.x[0, self._layout.motor_q], cutoff)
        links = robot.link_encoder
        self._links = None if links is None else _Differences(links, reference.x[0, self._layout.joint_q], cutoff)

    def take(self, sample: Sample) -> None:
        """Uses readings of the encoders that are newer than the last."""
        for differences in (self._motors, self._links):
            if differences is not None:
                differences.take(sample)

    def state(self, tick: int, now: float, past: Trajectory) -> Array:
        """Where the encoders are; links without any keep the planned stretch of their springs, shape (d,)."""
        layout, planned = self._layout, self._reference.x[tick]
        x = planned.copy()
        x[layout.motor_q], x[layout.motor_v] = self._motors.q, self._motors.v
        if self._links is not None:
            x[layout.joint_q], x[layout.joint_v] = self._links.q, self._links.v
            return x
        for links, motors in ((layout.joint_q, layout.motor_q), (layout.joint_v, layout.motor_v)):
            x[links] = planned[links] + joint_angles(self._robot, x[motors] - planned[motors])
        return x

    def commanded(self, now: float, command: Array) -> None:
        """Needs none."""


class _Differences:
    """The last angle of an encoder, and its velocity behind a low-pass of first order."""

    def __init__(self, encoder: Encoder, start: Array, cutoff: float):
        self._name, self._zero = encoder.name, encoder.zero
        self._time_constant = 1.0 / (2.0 * np.pi * cutoff)
        self._stamp: float | None = None
        self.q, self.v = start, np.zeros(len(start))

    def take(self, sample: Sample) -> None:
        """Uses a reading of this encoder that is newer than the last."""
        if sample.sensor != self._name or (self._stamp is not None and sample.stamp <= self._stamp):
            return
        q = sample.values - self._zero
        if self._stamp is not None:
            step = sample.stamp - self._stamp
            self.v = self.v + (1.0 - np.exp(-step / self._time_constant)) * ((q - self.q) / step - self.v)
        self._stamp, self.q = sample.stamp, q
