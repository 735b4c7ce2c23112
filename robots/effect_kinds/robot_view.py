# SPDX-License-Identifier: BSD-3-Clause
"""What an effect may ask of the robot that it acts on, so that robots can be made of effects without a circle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.parts.model_choices import ModelChoices
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.pose_setup import PoseSetup
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Accelerometer, Gyro, LinkEncoder, MotorEncoder, Topic


class RobotView(Protocol):
    """The part of a `Robot` that effects see; its attributes are described there."""

    @property
    def n(self) -> int:
        """Number of joints."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, base to tip."""

    @property
    def tree(self) -> RigidTree:
        """Rigid bodies."""

    @property
    def choices(self) -> ModelChoices:
        """Choices of the model."""

    @property
    def constants(self) -> Mapping[str, float]:
        """Known numbers by name."""

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters by full name."""

    @property
    def command(self) -> Topic:
        """Where the commands are, and their unit."""

    @property
    def poses(self) -> PoseSetup | None:
        """What is measured of the arm at rest; None where nothing is."""

    @property
    def gyros(self) -> Sequence[Gyro]:
        """All gyroscopes."""

    @property
    def accelerometers(self) -> Sequence[Accelerometer]:
        """All accelerometers."""

    @property
    def targets(self) -> Sequence[PositionTarget]:
        """All targets that a tracker measures."""

    @property
    def motor_encoder(self) -> MotorEncoder:
        """The encoders on the motors."""

    @property
    def link_encoder(self) -> LinkEncoder | None:
        """The encoders on the links, if there are any."""

    def parameter(self, name: str) -> Parameter:
        """A parameter by full name."""

    @property
    def drive_gain(self) -> str | None:
        """Name of the parameter that turns commands into torques; None where the command is a torque."""

    def drive_parameter(self, joint: str, name: str) -> Parameter:
        """A parameter of a joint's drive: the joint's own, or the one all motors share."""

    def unit_at(self, owner: str, unit: str) -> str:
        """The unit of something at an owner, where joints may slide."""
