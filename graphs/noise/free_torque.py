# SPDX-License-Identifier: BSD-3-Clause
"""A free torque in each equation of motion: what a model lacks goes there instead of into the process noise.

A free torque z is a Gauss-Markov process, dz/dt = -z / T + white noise. It needs no factor of its own: it is a joint
torque with a memory, so the robot with free torques has up to 2n more states that all else handles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Card
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, Memory
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise

Array = NDArray[np.float64]

CORRELATION_TIME = 0.01  # [s] T; docs/method.md says what was measured
SPREAD = 30.0  # [N m] where a recording begins
WHITE_SHARE = 0.3  # of the model's densities: where the estimation of white beside free noise begins

CARD = Card(
    title="free torque",
    law="tau = z, dz/dt = -z / T + noise",
    explanation="A torque that follows no law; it takes what the model lacks.",
    source="Gauss-Markov process",
    typical="as large as what is missing",
    excitation="any",
)


@dataclass(frozen=True)
class FreeTorques:
    """A robot with free torques.

    Attributes:
        robot: the model with one more memory for each free torque, behind its own memories.
        rows: equations in which they stand: "joint1.link", ..., "joint1.motor", ...
    """

    robot: Robot
    rows: tuple[str, ...]

    @staticmethod
    def of(robot: Robot, correlation_time: float = CORRELATION_TIME) -> FreeTorques:
        """Adds a free torque to the link's equation of each joint and to the motor's of each elastic one.

        They begin with the power at low frequencies that the model's own process noise has.

        Args:
            robot: the model.
            correlation_time: T [s].
        """
        places = [("link", joint) for joint in robot.joints] + [("motor", joint) for joint in robot.layout.motors]
        impulses = _impulse_densities(robot)
        density = np.array([impulses[f"{joint}.{side}"] for side, joint in places]) / correlation_time
        effects = [_free_torque(*place, float(s), correlation_time) for place, s in zip(places, density, strict=True)]
        noise = replace(
            robot.noise,
            link_velocity=WHITE_SHARE * robot.noise.link_velocity,
            motor_velocity=WHITE_SHARE * robot.noise.motor_velocity,
            memory=np.concatenate([robot.noise.memory, density]),
        )
        free = replace(robot, effects=(*robot.effects, *effects), noise=noise)
        return FreeTorques(free, tuple(f"{joint}.{side}" for side, joint in places))

    @property
    def columns(self) -> NDArray[np.intp]:
        """Column of each free torque in the state, shape (k,)."""
        size = self.robot.layout.size
        return np.arange(size - len(self.rows), size)

    def white(self, noise: ProcessNoise) -> ProcessNoise:
        """Noise of the robot with free torques as noise of the robot without them."""
        return replace(noise, memory=noise.memory[: len(noise.memory) - len(self.rows)])


def _impulse_densities(robot: Robot) -> dict[str, float]:
    """Density of each equation's process noise as a torque, by name [N m sqrt(s)]."""
    layout, noise = robot.layout, robot.noise
    alone = robot.free_inertias()
    motor = np.array([robot.drive_parameter(joint, "inertia").value for joint in layout.motors])
    density = np.concatenate([alone * noise.link_velocity, motor * noise.motor_velocity])
    return dict(zip(layout.rate_names, map(float, density), strict=False))


def _free_torque(side: str, joint: str, density: float, correlation_time: float) -> EffectAt:
    def law(s: JointSignals, p: Mapping[str, Any]) -> Any:
        return s.memory

    def rate(s: JointSignals, p: Mapping[str, Any]) -> Any:
        return -s.memory / correlation_time

    memory = Memory(rate=rate, noise=density, spread=SPREAD)
    return EffectAt(JointTorque(id=f"free_{side}_torque", card=CARD, side=side, law=law, memory=memory), joint)
