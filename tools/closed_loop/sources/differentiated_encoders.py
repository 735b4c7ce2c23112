# SPDX-License-Identifier: BSD-3-Clause
"""(c) What is done without an estimator: encoders, their differences behind a low-pass, links where the plan has them.

    q_motor = the last reading
    v_motor = difference of the last two readings over the time between their stamps, behind a low-pass of first order
    q_link  = q_motor - planned stretch of the spring, and v_link likewise; hinges of bearings as planned

Taking the link to be where the motor is would charge the encoders with the stretch that anyone with a model can plan.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.robot import Robot
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
        self._encoder, self._layout, self._reference = robot.motor_encoder, robot.layout, reference
        self._time_constant = 1.0 / (2.0 * np.pi * cutoff)
        self._stamp: float | None = None
        self._q = reference.x[0, self._layout.motor_q]
        self._v = np.zeros(robot.n)

    def take(self, sample: Sample) -> None:
        """Uses readings of the encoders that are newer than the last."""
        if sample.sensor != self._encoder.name or (self._stamp is not None and sample.stamp <= self._stamp):
            return
        q = sample.values - self._encoder.zero
        if self._stamp is not None:
            step = sample.stamp - self._stamp
            self._v = self._v + (1.0 - np.exp(-step / self._time_constant)) * ((q - self._q) / step - self._v)
        self._stamp, self._q = sample.stamp, q

    def state(self, tick: int, now: float, past: Trajectory) -> Array:
        """The plan's state, moved to where the encoders are, shape (d,)."""
        layout, planned = self._layout, self._reference.x[tick]
        x = planned.copy()
        for found, links, motors in (
            (self._q, layout.joint_q, layout.motor_q),
            (self._v, layout.joint_v, layout.motor_v),
        ):
            error = found - planned[motors]
            x[links] = planned[links] + joint_angles(self._robot, error)
            x[motors] = planned[motors] + error
        return x

    def commanded(self, now: float, command: Array) -> None:
        """Needs none."""
