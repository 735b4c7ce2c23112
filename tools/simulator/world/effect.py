# SPDX-License-Identifier: BSD-3-Clause
"""The contract of a simulated effect: one subclass per file in `effects/`, registered by being there.

An effect says what it is called, what it acts on and the sizes it has by default, and overrides those hooks that it
needs. Hooks run in this order: `couple` and `edit` once, before the engine compiles its model; `bind` once, after;
then `command` once per fine step, `torque` at every force evaluation (four per fine step), `age` and `reading` of the
encoders at every tick of the controller; and after the run `taken_at`, `age`, `reading` and `logged` per sensor.
Prefer `edit`: what the engine has of its own is fast and shares nothing with the estimator.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.errors import EffectError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import LinkEncoder, MotorEncoder, Sensor

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Address:
    """Where the robot's coordinates are in the engine's vectors; every coordinate has one degree of freedom.

    Attributes:
        link: index of each joint's link coordinate in qpos and qvel, by joint name.
        motor: the same for the rotors; of a rigid joint that of its link.
        actuator: index of each joint's motor in ctrl.
    """

    link: Mapping[str, int]
    motor: Mapping[str, int]
    actuator: Mapping[str, int]


class SimulatedEffect:
    """A physical effect in the simulated robot.

    Args:
        owner: the joint, gyro or "robot" it belongs to.
        parameters: values that differ from the defaults.
        robot: the robot with its true parameters.

    Attributes:
        parameters: all values by name.
        id: name of the effect, that of its file.
        acts_on: kinds of owners, of "joint", "elastic joint", "last joint", "imu", "target", "robot", "upright robot",
            "robot with a target", "link encoders" and "weighed elastic joint".
        defaults: parameters with their sizes; an effect without fixed ones overrides `default_parameters`.
        null: the value of a size at which the effect vanishes; zero but for ratios.
        never_negative: parameters that must not be negative.
        above_zero: parameters that must be positive: shapes, which mean nothing where the sizes are zero.
        outside_catalogue: the estimator has no such effect, so it can only say that something is left.
        mistake: not physics but a wrong setting.
        loads_at_rest: the engine must settle before the recording begins.
        built_in: with dry friction, elements of the engine are the whole effect, so that a saved model has it.
        friction: the engine's Coulomb friction, "dry" or "smooth"; set by the engine before `edit`.
        shares: of the links in the deflection of each spring, by names of joints; set by the engine before `edit`.

    Raises:
        EffectError: wrong owner, unknown parameter, impossible value.
    """

    id: ClassVar[str]
    acts_on: ClassVar[tuple[str, ...]]
    defaults: ClassVar[Mapping[str, float]]
    null: ClassVar[float] = 0.0
    never_negative: ClassVar[tuple[str, ...]] = ()
    above_zero: ClassVar[tuple[str, ...]] = ()
    outside_catalogue: ClassVar[bool] = False
    mistake: ClassVar[bool] = False
    loads_at_rest: ClassVar[bool] = False
    built_in: ClassVar[bool] = False
    friction: str = "dry"
    shares: Mapping[str, Mapping[str, float]]

    def __init__(self, owner: str, parameters: Mapping[str, float], robot: Robot):
        owners = [name for kind in self.acts_on for name in owners_of(kind, robot)]
        if owner not in owners:
            acts = f"acts on {', '.join(owners)}" if owners else f"needs {_one_of(self.acts_on)}, and there is none"
            raise EffectError(f"effect {self.id} cannot act on {owner!r}; it {acts}")
        self.owner = owner
        self.robot = robot
        defaults = self.default_parameters()
        unknown = [name for name in parameters if name not in defaults]
        if unknown:
            raise EffectError(f"effect {self.id} has no parameter {unknown[0]!r}; it has {', '.join(defaults)}")
        self.parameters = {**defaults, **parameters}
        for name, value in self.parameters.items():
            self._check(name, value)

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints concerned: the owner, or all joints of the robot."""
        return self.robot.joints if self.owner == "robot" else (self.owner,)

    @classmethod
    def kind(cls) -> str:
        """One of "catalogue", "outside" (the catalogue) and "mistake"."""
        return "mistake" if cls.mistake else "outside" if cls.outside_catalogue else "catalogue"

    def default_parameters(self) -> Mapping[str, float]:
        """Parameters and their sizes for this owner and robot."""
        return self.defaults

    def couple(self, T: Array) -> None:
        """Changes the joint angles per motor angle with no spring stretched, shape (n_joints, n_joints), in place."""

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
        """The times at which a sensor gave out the samples with these stamps, shape (m,) [s].

        This is about clocks: the controller, which reads and does not stamp, sees none of it.
        """
        return stamps

    def age(self, sensor: Sensor) -> Array:
        """How old a reading is already when the sensor gives it out, shape (channels,) [s], never negative.

        The controller gets the old encoder readings, too.
        """
        return np.zeros(len(sensor.channels))

    def reading(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """What a sensor reads instead of the true value, before bias, noise and quantization, shape (m, channels).

        For the motor encoders, the controller sees it, too, one tick at a time in the order of time.
        """
        return values

    def logged(self, sensor: Sensor, stamps: Array, values: Array) -> Array:
        """What the bag holds instead of what the sensor gave out, shape (m, channels); the controller sees none."""
        return values

    def uses(self, hook: str) -> bool:
        """Whether this effect overrides a hook; those that it does not override cost nothing."""
        return getattr(type(self), hook) is not getattr(SimulatedEffect, hook)

    def sensed_by(self, sensor: Sensor) -> bool:
        """Whether a sensor is the owner or one of the owner's: all are the robot's."""
        return self.owner in ("robot", sensor.name)

    def encoder_channels(self, sensor: Sensor) -> list[int]:
        """Channels of the motor encoders that belong to the joints concerned; none of another sensor.

        The owner JOINT.link concerns the joint's encoder on the link instead.
        """
        if self.owner.endswith(LINK_SIDE):
            own = self.owner.removesuffix(LINK_SIDE)
            return [sensor.joints.index(own)] if isinstance(sensor, LinkEncoder) else []
        if not isinstance(sensor, MotorEncoder):
            return []
        return [sensor.joints.index(joint) for joint in self.joints if joint in sensor.joints]

    def _check(self, name: str, value: float) -> None:
        if not np.isfinite(value):
            raise EffectError(f"effect {self.id}@{self.owner}: {name} must be finite, got {value:g}")
        if value < 0 and name in self.never_negative:
            raise EffectError(f"effect {self.id}@{self.owner}: {name} must not be negative, got {value:g}")
        if value <= 0 and name in self.above_zero:
            raise EffectError(f"effect {self.id}@{self.owner}: {name} must be positive, got {value:g}")


def owners_of(kind: str, robot: Robot) -> tuple[str, ...]:
    """Names of the owners of a kind; an upright robot feels gravity along -z of its base, a weighed joint any."""
    if kind == "imu":
        return tuple(gyro.name for gyro in robot.gyros)
    if kind == "link encoders":
        return () if robot.link_encoder is None else (robot.link_encoder.name,)
    if kind == "target":
        return tuple(target.name for target in robot.targets)
    elastic = tuple(joint for joint in robot.joints if joint in robot.layout.motors)
    upright = ("robot",) if robot.tree.gravity[2] < 0.0 and not robot.tree.gravity[:2].any() else ()
    joints = {"joint": robot.joints, "elastic joint": elastic, "last joint": robot.joints[-1:]}
    seen = robot.joints if robot.link_encoder is not None else ()
    joints["joint seen on the link"] = tuple(f"{joint}{LINK_SIDE}" for joint in seen)
    joints["weighed elastic joint"] = elastic if robot.tree.gravity.any() else ()
    seen_at_rest = ("robot",) if robot.poses is not None else ()
    return {**joints, "robot": ("robot",), "upright robot": upright, "robot with a target": seen_at_rest}[kind]


def _one_of(kinds: Sequence[str]) -> str:
    """As "a joint or an imu"."""
    return " or ".join(f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}" for kind in kinds)
