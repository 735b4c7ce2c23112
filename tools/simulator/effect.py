# SPDX-License-Identifier: BSD-3-Clause
"""The contract of a simulated effect: one subclass per file in `effects/`, registered by being there.

An effect says what it is called, what it acts on and the sizes it has by default, and overrides those hooks that it
needs. Hooks run in this order: `edit` once, before the engine compiles its model; `bind` once, after; then `command`
once per fine step, `torque` at every force evaluation (four per fine step); and after the run `taken_at` and `reading`
per sensor. Prefer `edit`: what the engine has of its own is fast and shares nothing with the estimator.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import EffectError
from jointscope.robots.robot import Robot
from jointscope.robots.sensors import Sensor

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Address:
    """Where the robot's coordinates are in the engine's vectors; every coordinate has one degree of freedom.

    Attributes:
        link: index of each joint's link coordinate in qpos and qvel, by joint name.
        motor: the same for the rotors.
        actuator: index of each joint's motor in ctrl.
    """

    link: Mapping[str, int]
    motor: Mapping[str, int]
    actuator: Mapping[str, int]


class SimulatedEffect:
    """A physical effect in the simulated robot.

    Args:
        owner: the joint, gyro or "robot" it belongs to.
        parameters: values that differ from `defaults`.
        robot: the robot with its true parameters.

    Raises:
        EffectError: wrong owner, unknown parameter.
    """

    id: ClassVar[str]
    acts_on: ClassVar[str]  # "joint" | "gyro" | "robot"
    defaults: ClassVar[Mapping[str, float]]

    def __init__(self, owner: str, parameters: Mapping[str, float], robot: Robot):
        owners = {"joint": robot.joints, "gyro": tuple(g.name for g in robot.gyros), "robot": ("robot",)}[self.acts_on]
        if owner not in owners:
            raise EffectError(f"effect {self.id} cannot act on {owner!r}; it acts on {', '.join(owners)}")
        unknown = [name for name in parameters if name not in self.defaults]
        if unknown:
            raise EffectError(f"effect {self.id} has no parameter {unknown[0]!r}; it has {', '.join(self.defaults)}")
        self.owner = owner
        self.robot = robot
        self.parameters = {**self.defaults, **parameters}

    def edit(self, spec: Any) -> None:
        """Changes the `mujoco.MjSpec` before it is compiled."""

    def bind(self, model: Any, data: Any, address: Address) -> None:
        """Remembers what `torque` needs; views such as data.qvel stay valid during the whole run."""

    def command(self, time: float, issued: Array) -> Array:
        """The command that acts now, given the one that the controller has issued last.

        Called once per fine step in the order of time, so it may keep a history.

        Args:
            time: of the fine step [s].
            issued: command as it is logged, shape (n_joints,), in the unit of the robot's command.

        Returns:
            The acting command, shape (n_joints,).
        """
        return issued

    def torque(self) -> None:
        """Adds generalized torques to data.qfrc_passive for the present data.qpos and data.qvel, without memory."""

    def taken_at(self, sensor: Sensor, stamps: Array) -> Array:
        """The times at which samples with these stamps were really taken, shape (m,) [s]; the controller sees none."""
        return stamps

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """What a sensor reads instead of the true value, before noise and quantization, shape (m, channels).

        For the motor encoders, the controller sees it, too, one tick at a time in the order of time.
        """
        return values

    def uses(self, hook: str) -> bool:
        """Whether this effect overrides a hook; those that it does not override cost nothing."""
        return getattr(type(self), hook) is not getattr(SimulatedEffect, hook)
