# SPDX-License-Identifier: BSD-3-Clause
"""The sensors of a robot: where their samples are in a bag, and what they measure of the state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.units import si_factor, si_unit

AXES = ("x", "y", "z")
RIGHT_FROM_LEFT = (-1.0, 1.0, 1.0)  # factors on left-handed axes that make them right-handed
BY_MESSAGE = "message"  # a joint that was sampled at the stamp of its message


@dataclass(frozen=True)
class Topic:
    """Where the samples of one stream are in a bag.

    Attributes:
        topic: name of the topic.
        msgtype: ROS type, for example "sensor_msgs/msg/JointState".
        field: field of the message that holds the sample, dots descend ("angular_velocity").
        unit: unit in the bag; converted to SI when read.
        units: unit of each joint where they are not all the same; empty where `unit` is that of all.
        names: name in the message for each joint of the robot, in the robot's order; empty for streams without names.
        scale: factor on the value of each joint, such as the ratio of its gear; empty for none.
        stamped_by: sensor whose i-th stamp is the time at which each joint's i-th sample was taken, or BY_MESSAGE for
            the stamp of the message; empty where that holds for all joints.
        wraps: period after which the counter behind the value begins anew, in the unit of the bag; 0 if it does not.
        held: of a drive signal: whether each value acts until the next one, as a command does, or was measured and runs
            on between samples; None where the robot file does not say.
        confirmed: of a drive signal: whether the user knows its unit, so that no size of a constant speaks against it.
    """

    topic: str
    msgtype: str
    field: str
    unit: str
    names: tuple[str, ...] = ()
    scale: tuple[float, ...] = ()
    wraps: float = 0.0
    units: tuple[str, ...] = ()
    stamped_by: tuple[str, ...] = ()
    held: bool | None = None
    confirmed: bool = False

    def source_is(self, other: Topic) -> bool:
        """Whether another stream is the same field of the same messages."""
        return (self.topic, self.field) == (other.topic, other.field)

    @property
    def factor(self) -> NDArray[np.float64]:
        """From values in the bag to SI units, shape (c,) or ()."""
        by_unit = np.array([si_factor(unit) for unit in self.units]) if self.units else np.array(si_factor(self.unit))
        return by_unit * np.asarray(self.scale or 1.0)

    def bag_units(self, channels: int) -> tuple[str, ...]:
        """Unit in the bag of each of the channels."""
        return self.units or (self.unit,) * channels

    def si_units(self, channels: int) -> tuple[str, ...]:
        """SI unit of each of the channels."""
        return tuple(si_unit(unit) for unit in self.bag_units(channels))


@dataclass(frozen=True)
class Encoder:
    """Encoders on all joints, in link units: theta_measured = q + zero + noise.

    Attributes:
        name: key in the robot file.
        source: topic.
        sigmas: standard deviation of the noise of each joint, shape (n_joints,) [rad, of a prismatic joint m].
        zero: reading at q = 0, shape (n_joints,) [rad or m].
        joints: names of the joints.
        estimate_sigma: whether a calibration may find other sigmas.
        zero_known: False for an incremental encoder, whose zero is another one in each recording.
    """

    name: str
    source: Topic
    sigmas: NDArray[np.float64]
    zero: NDArray[np.float64]
    joints: tuple[str, ...]
    estimate_sigma: bool = True
    zero_known: bool = True

    side: ClassVar[str]

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names, one per joint."""
        return tuple(f"{joint}.{self.side}_position" for joint in self.joints)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each channel."""
        return self.source.si_units(len(self.joints))


@dataclass(frozen=True)
class MotorEncoder(Encoder):
    """On the motors, q = q_motor (eq. 20)."""

    side = "motor"


@dataclass(frozen=True)
class LinkEncoder(Encoder):
    """On the links, behind the transmission, q = q_link."""

    side = "link"


@dataclass(frozen=True)
class TorqueSensor:
    """Torques that the springs pass on to their links: theta = scale tau + offset + noise, behind the motors' friction.

    Attributes:
        name: key in the robot file.
        source: topic.
        sigma: standard deviation of the noise [N m].
        joints: names of the joints.
    """

    name: str
    source: Topic
    sigma: float
    joints: tuple[str, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names, one per joint."""
        return tuple(f"{joint}.joint_torque" for joint in self.joints)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each channel."""
        return ("N m",) * len(self.joints)

    @property
    def parameters(self) -> tuple[tuple[str, str], ...]:
        """Full names of scale [1] and offset [N m] of each joint, which a robot file may have."""
        return tuple((f"{self.name}.scale_{joint}", f"{self.name}.offset_{joint}") for joint in self.joints)

    @property
    def own(self) -> tuple[str, ...]:
        """All of these names."""
        return tuple(name for pair in self.parameters for name in pair)

    def scale_and_offset(self, values: Mapping[str, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Scale and offset of each joint, shape (n_joints,); 1 and 0 [N m] where no parameter says another."""
        pairs = [(values.get(scale, 1.0), values.get(offset, 0.0)) for scale, offset in self.parameters]
        scale, offset = np.array(pairs).T
        return scale, offset

    @property
    def sigmas(self) -> NDArray[np.float64]:
        """Standard deviation of the noise of each channel, shape (n_joints,) [N m]."""
        return np.full(len(self.joints), self.sigma)


@dataclass(frozen=True)
class Gyro:
    """A three-axis gyroscope on a body: omega_imu = R_imu_body omega_body + bias + noise.

    Attributes:
        name: key in the robot file ("imu1").
        source: topic.
        body: URDF link that carries the sensor.
        form: "full" (three components predicted from the state), "vertical" (eq. 22: only the component along the
            joint axis) or "relative" (eq. 26: predicted from the measured rate of the gyro named in `reference`).
        sigma: standard deviation of the noise of each component [rad/s].
        bias: offset in the sensor frame, shape (3,) [rad/s].
        bias_prior_sigma: standard deviation of the prior of the bias [rad/s].
        R_imu_body: rotation from body to sensor coordinates, shape (3, 3).
        R_prior: mean of the rotation's prior, shape (3, 3).
        R_prior_sigma: standard deviation of the rotation's prior about each axis of the body [rad].
        reference: for form "relative": the gyro whose measured rate is used.
        bias_sigma, R_sigma: standard deviations after calibration, shape (3,) [rad/s], [rad]; None before.
        left_handed: whether the axes in the bag are left-handed. Their x is turned when they are read (`source.scale`),
            so that omega_bag = diag(-1, 1, 1) (R_imu_body omega_body + bias): rotation and bias are those of
            right-handed axes.
    """

    name: str
    source: Topic
    body: str
    form: str
    sigma: float
    bias: NDArray[np.float64]
    bias_prior_sigma: float
    R_imu_body: NDArray[np.float64]
    R_prior: NDArray[np.float64]
    R_prior_sigma: float
    reference: str | None = None
    bias_sigma: NDArray[np.float64] | None = None
    R_sigma: NDArray[np.float64] | None = None
    left_handed: bool = False

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names, one per axis."""
        return tuple(f"{self.name}.{axis}" for axis in AXES)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each channel."""
        return ("rad/s",) * 3

    @property
    def sigmas(self) -> NDArray[np.float64]:
        """Standard deviation of the noise of each channel, shape (3,) [rad/s]."""
        return np.full(3, self.sigma)


@dataclass(frozen=True)
class Accelerometer:
    """The accelerometer of an IMU: f_imu = R_imu_body (a_point - g)_body + bias + noise.

    Body and rotation are those of the IMU's gyro; the point where it sits, p_body, is three parameters of the robot,
    NAME.lever_x, lever_y and lever_z [m].

    Attributes:
        name: key in the robot file ("accelerometer1").
        source: topic.
        gyro: name of the gyro of the same IMU, whose body and rotation it shares.
        sigma: standard deviation of the noise of each component [m/s^2].
        bias: offset in the sensor frame, shape (3,) [m/s^2].
        bias_prior_sigma: standard deviation of the prior of the bias [m/s^2].
        bias_sigma: standard deviation after calibration, shape (3,) [m/s^2]; None before.
        gravity: acceleration of gravity in the base frame, shape (3,) [m/s^2], where the joints do not feel it because
            springs carry the weight; None for that of the robot.
    """

    name: str
    source: Topic
    gyro: str
    sigma: float
    bias: NDArray[np.float64]
    bias_prior_sigma: float
    bias_sigma: NDArray[np.float64] | None = None
    gravity: NDArray[np.float64] | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names, one per axis."""
        return tuple(f"{self.name}.{axis}" for axis in AXES)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each channel."""
        return ("m/s^2",) * 3

    @property
    def sigmas(self) -> NDArray[np.float64]:
        """Standard deviation of the noise of each channel, shape (3,) [m/s^2]."""
        return np.full(3, self.sigma)

    @property
    def lever(self) -> tuple[str, ...]:
        """Names of the parameters with its place on the body."""
        return tuple(f"{self.name}.lever_{axis}" for axis in AXES)

    own = lever

    def place(self, parameters: Mapping[str, Parameter]) -> NDArray[np.float64]:
        """Where it sits on its body, p_body, shape (3,) [m]."""
        return np.array([parameters[name].value for name in self.lever])


Sensor = MotorEncoder | LinkEncoder | TorqueSensor | MotorCurrent | Gyro | Accelerometer | PositionTarget
