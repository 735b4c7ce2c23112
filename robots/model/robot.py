# SPDX-License-Identifier: BSD-3-Clause
"""A robot with elastic joints: rigid tree, drives, sensors, parameters and their priors.

A Robot is immutable; a calibration returns a new one. It is read from and written to a robot file (robot_file.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import Memory
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.errors import RobotError
from jointscope.robots.model.structured_tree import bearing_names, with_bearings
from jointscope.robots.parts.derived import Derived
from jointscope.robots.parts.frequency_setup import FrequencySetup
from jointscope.robots.parts.model_choices import ModelChoices
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.pose_setup import PoseSetup
from jointscope.robots.parts.position_controller import PositionController
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.parts.sensors import Accelerometer, Gyro, LinkEncoder, MotorEncoder, Sensor, Topic, TorqueSensor
from jointscope.robots.parts.state_layout import StateLayout
from jointscope.robots.units import joined, of_slide

SHARPNESS = "friction_sharpness"  # of a joint whose dry friction turns over as its own parameter says
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Robot:
    """Everything that is known about a robot.

    Attributes:
        name: short name.
        description: one sentence.
        tree: rigid bodies.
        joints: names of the joints, base to tip.
        choices: model choices.
        constants: known numbers by name ("motor.supply_voltage" [V]).
        command: where the commands are; its unit is "duty", "V", "A" or "N m".
        sensors: by name.
        parameters: by full name, in the order of the file.
        noise: process noise, in the order of `layout`.
        effects: physical effects that were added to the base model.
        controller: that of drives which are commanded by a position; None for others, or where it is not known.
        path: the file it was read from.
        document: the file's content with comments, for writing it again.
        transmission: joint angles per motor angle, q_joint = T q_motor, shape (n, n); None for the identity.
        poses: what is measured of the arm at rest; None where nothing is.
        frequency: what is shaken for frequency responses; None where nothing is.
        motion: whether the file describes drives and sensors, too, so that recordings of motion can be used.
        derived: results in other words and units, which follow from the parameters.
        held_at_mean: joints in `locked` that move in recordings, and are held on the user's word.
        as_filed: the rigid bodies as the file has them, where `tree` is in another posture.
    """

    name: str
    description: str
    tree: RigidTree
    joints: tuple[str, ...]
    choices: ModelChoices
    constants: Mapping[str, float]
    command: Topic
    sensors: Mapping[str, Sensor]
    parameters: Mapping[str, Parameter]
    noise: ProcessNoise
    path: Path
    document: Any
    effects: tuple[EffectAt, ...] = ()
    controller: PositionController | None = None
    as_filed: RigidTree | None = None
    held_at_mean: tuple[str, ...] = ()
    transmission: Array | None = None
    poses: PoseSetup | None = None
    frequency: FrequencySetup | None = None
    motion: bool = True
    derived: tuple[Derived, ...] = ()

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @property
    def motor_encoder(self) -> MotorEncoder:
        """The encoders on the motors."""
        for sensor in self.sensors.values():
            if isinstance(sensor, MotorEncoder):
                return sensor
        raise RobotError(f"robot {self.name!r} has no sensor of kind motor_encoder")

    @property
    def link_encoder(self) -> LinkEncoder | None:
        """The encoders on the links, where there are any."""
        return next((sensor for sensor in self.sensors.values() if isinstance(sensor, LinkEncoder)), None)

    @property
    def torque_sensor(self) -> TorqueSensor | None:
        """The sensors of the torques in the joints, where there are any."""
        return next((sensor for sensor in self.sensors.values() if isinstance(sensor, TorqueSensor)), None)

    @property
    def motor_current(self) -> MotorCurrent | None:
        """The measured currents of the motors, where there are any."""
        return next((sensor for sensor in self.sensors.values() if isinstance(sensor, MotorCurrent)), None)

    @property
    def free_links(self) -> bool:
        """Whether the links' masses are not known, so that there are no equations of motion."""
        return self.choices.link_dynamics == "free"

    def need_link_dynamics(self) -> None:
        """Raises RobotError for a robot without equations of motion: its links are free, or it has no drives."""
        self.need_motion()
        if self.free_links:
            raise RobotError(
                f"{self.name} has link_dynamics: free, so there are no equations of motion to predict with; "
                "`calibrate` and `discover` compare motors, links and gyros without them"
            )

    def need_motion(self) -> None:
        """Raises RobotError for a robot file without drives and sensors."""
        if not self.motion:
            kinds = [kind for kind in ("poses", "frequency") if getattr(self, kind) is not None]
            raise RobotError(
                f"{self.path.name} has no `command` and no `sensors`: it describes {' and '.join(kinds)}; give them "
                f"with --{' or --'.join(kinds)}, or add both sections for recordings of motion"
            )

    @property
    def gyros(self) -> tuple[Gyro, ...]:
        """All gyroscopes."""
        return tuple(sensor for sensor in self.sensors.values() if isinstance(sensor, Gyro))

    @property
    def accelerometers(self) -> tuple[Accelerometer, ...]:
        """All accelerometers."""
        return tuple(sensor for sensor in self.sensors.values() if isinstance(sensor, Accelerometer))

    @property
    def targets(self) -> tuple[PositionTarget, ...]:
        """All targets whose positions a tracker measures."""
        return tuple(sensor for sensor in self.sensors.values() if isinstance(sensor, PositionTarget))

    @property
    def biased(self) -> tuple[Gyro | Accelerometer, ...]:
        """The sensors whose offset is another one in each recording: gyros first."""
        return (*self.gyros, *self.accelerometers)

    def without(self, sensors: Sequence[Accelerometer | MotorCurrent | TorqueSensor]) -> Robot:
        """The robot for what does not ask some sensors; their own parameters stay as they are."""
        if not sensors:
            return self
        gone, own = {s.name for s in sensors}, {name for s in sensors for name in s.own}
        parameters = {n: replace(p, fixed=True) if n in own else p for n, p in self.parameters.items()}
        return replace(self, sensors={n: s for n, s in self.sensors.items() if n not in gone}, parameters=parameters)

    def gravity_at(self, accelerometer: Accelerometer) -> Array:
        """Gravity as an accelerometer feels it, in the base frame, shape (3,) [m/s^2]."""
        return self.tree.gravity if accelerometer.gravity is None else accelerometer.gravity

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all measured channels."""
        return tuple(channel for sensor in self.sensors.values() for channel in sensor.channels)

    @cached_property
    def layout(self) -> StateLayout:
        """Where everything is in a state vector."""
        soft, elastic = self._owners_of("bearing"), self._owners_of("elasticity")
        links = [name for j in self.joints for name in ((*bearing_names(j), j) if j in soft else (j,))]
        motors = [j for j in self.joints if j not in self.choices.rigid_joints or j in elastic]
        equations = [f"{name}.link" for name in links] + [f"{name}.motor" for name in motors]
        lasting = [f"{name}_torque" for name in equations[: self.noise.n_lasting]]
        return StateLayout(self.joints, tuple(links), tuple(motors), (*self.memories, *lasting))

    @cached_property
    def kinematic_tree(self) -> RigidTree:
        """The rigid bodies with the hinges of soft bearings, and with Coriolis terms where an effect scales them."""
        soft = self._owners_of("bearing")
        tree = self.tree.with_model(with_bearings(self.tree.model, soft)) if soft else self.tree
        return tree.with_coriolis(True) if self._owners_of("coriolis") else tree

    def _owners_of(self, form: str) -> tuple[str, ...]:
        return tuple(h.owner for h in self.effects if isinstance(h.effect, Structure) and h.effect.form == form)

    def free_inertias(self) -> NDArray[np.float64]:
        """Inertia of each link coordinate while others are free, or its rotor's alone, shape (n_link,) [kg m^2]."""
        alone = self.kinematic_tree.free_inertias()
        for joint in self.tree.massless:
            alone[self.layout.joint_link[self.joints.index(joint)]] = self.drive_parameter(joint, "inertia").value
        return alone

    @property
    def memories(self) -> dict[str, Memory]:
        """States that effects bring along, by the label of the effect, the first memories of the layout."""
        found = ((here.label, here.effect.memory_at(self, here.owner)) for here in self.effects)
        return {label: memory for label, memory in found if memory is not None}

    def unit_at(self, owner: str, unit: str) -> str:
        """The unit of a quantity at an owner, where `unit` is that at a joint that turns."""
        return of_slide(unit) if owner in self.tree.slides else unit

    def unit(self, unit: str) -> str:
        """The units of a quantity of all joints, where `unit` is that at joints that turn: "rad", "m" or "rad, m"."""
        return joined([self.unit_at(joint, unit) for joint in self.joints])

    def has_effect(self, effect_id: str, owner: str) -> bool:
        """Whether an effect is part of the robot."""
        return any(here.effect.id == effect_id and here.owner == owner for here in self.effects)

    @property
    def command_volts(self) -> float:
        """Volts per unit of command, where the command is a duty cycle or a voltage."""
        return self.constants.get("motor.supply_voltage", 1.0) if self.command.unit == "duty" else 1.0

    @property
    def values(self) -> dict[str, float]:
        """Present values of all parameters, by full name."""
        return {name: parameter.value for name, parameter in self.parameters.items()}

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name.

        Raises:
            RobotError: there is none; the message lists the names.
        """
        if name not in self.parameters:
            raise RobotError(f"robot {self.name!r} has no parameter {name!r}; it has {', '.join(self.parameters)}")
        return self.parameters[name]

    @property
    def command_held(self) -> bool:
        """Whether a value of the drive signal acts until the next one; a measured one runs on between its samples.

        One that comes with the positions, in the same message, was measured, unless the robot file says otherwise.
        """
        held, topics = self.command.held, (sensor.source.topic for sensor in self.sensors.values())
        return self.command.topic not in topics if held is None else held

    @property
    def drive_gain(self) -> str | None:
        """Law that turns commands into torques: of a voltage, of a current; None where the command is a torque."""
        return {"N m": None, "A": "torque_constant"}.get(self.command.unit, "k_pwm")

    def friction_sharpness(self, values: Mapping[str, float] | None = None) -> Array:
        """Sharpness k in tanh(k v) of each joint's dry friction, shape (n,) [s/rad or s/m]; `values` as in the next."""
        return np.array([self.sharpness_of(joint, values) for joint in self.joints])

    def sharpness_of(self, joint: str, values: Mapping[str, float] | None = None) -> float:
        """The same of one joint: from `values` by full name, its own parameter, or that of the model's choices."""
        name = f"{joint}.{SHARPNESS}"
        if values is not None and name in values:
            return values[name]
        return self.parameters[name].value if name in self.parameters else self.choices.friction_sharpness

    @property
    def drive_laws(self) -> tuple[str, ...]:
        """The gain, where there is one, and the back-EMF of a motor that is driven by a voltage."""
        return {None: (), "k_pwm": ("k_pwm", "k_mi")}.get(self.drive_gain, (str(self.drive_gain),))

    def drive_parameter(self, joint: str, name: str) -> Parameter:
        """A parameter of a joint's drive: the joint's own if it has one, else the one all motors share."""
        own = f"{joint}.{name}"
        return self.parameters[own] if own in self.parameters else self.parameter(f"motor.{name}")

    def with_values(self, values: Mapping[str, float]) -> Robot:
        """The same robot with other parameter values, given by full name."""
        changed = {name: replace(self.parameter(name), value=float(value)) for name, value in values.items()}
        return replace(self, parameters={**self.parameters, **changed})

    def in_posture(self, positions: Mapping[str, float]) -> Robot:
        """The same robot with other joints held as in a recording, beside or instead of where its file locks them.

        Positions are those of joints of the URDF [rad] or [m]; others than those that matter are left out.
        """
        filed = self.as_filed or self.tree
        held = filed.locked | filed.posture(positions)
        return self if held == self.tree.locked else replace(self, tree=filed.locked_at(held), as_filed=filed)

    def locked_as_in(self, positions: Mapping[str, float]) -> Robot:
        """The same robot whose file locks joints it does not name yet as in a recording."""
        filed = self.as_filed or self.tree
        return replace(self, tree=filed.locked_at(filed.posture(positions) | filed.locked), as_filed=None)

    def with_sensors(self, sensors: Mapping[str, Sensor]) -> Robot:
        """The same robot with some sensors replaced."""
        return replace(self, sensors={**self.sensors, **sensors})
