# SPDX-License-Identifier: BSD-3-Clause
"""How sensors are sampled, mounted and read: their own times, bias, mounting error, noise and steps.

An encoder is quantized. Its step and the noise before it are chosen so that together they have the standard deviation
of the robot file: step^2 / 12 + noise^2 = sigma^2, with noise = 0.3 sigma.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointscope.robots.errors import SimulationError
from jointscope.robots.parts.sensors import Accelerometer, Gyro, LinkEncoder, MotorEncoder
from jointscope.tools.simulator.world.engine import TICK

Array = NDArray[np.float64]

ANALOG_SHARE = 0.3  # noise before quantization, share of the encoder's sigma
MOUNTING_SIGMA = np.deg2rad(2.0)  # [rad] about each axis
BIAS_SIGMA = 2e-3  # [rad/s] of the true bias about that of the robot file
ACCELERATION_BIAS_SIGMA = 0.05  # [m/s^2] the same of an accelerometer


@dataclass(frozen=True)
class Sampling:
    """How samples are taken and sent.

    Attributes:
        encoder_rate, gyro_rate: samples per second [Hz].
        jitter: standard deviation of a sample's time about its nominal one; the value is that of its own time [s].
        drop: probability that a sensor sample is lost. Commands are never lost.
        transport_delay: mean time from stamp to arrival [s].
        quantized: False gives encoders white Gaussian noise of the same sigma instead of steps.
        target_rate: samples per second of cameras and motion capture [Hz].
    """

    encoder_rate: float = 1.0 / TICK
    gyro_rate: float = 1.0 / TICK
    jitter: float = 0.0
    drop: float = 0.0
    transport_delay: float = 5e-4
    quantized: bool = True
    target_rate: float = 200.0

    def __post_init__(self) -> None:
        for name in ("encoder_rate", "gyro_rate", "target_rate"):
            if not 1.0 <= getattr(self, name) <= 1e5:
                raise SimulationError(f"{name.replace('_', ' ')}: expected 1 to 100000 Hz, got {getattr(self, name):g}")
        for name in ("jitter", "transport_delay"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise SimulationError(
                    f"{name.replace('_', ' ')}: expected 0 to 1000 ms, got {1e3 * getattr(self, name):g}"
                )
        if not 0.0 <= self.drop <= 0.95:
            raise SimulationError(f"drop: expected a probability of 0 to 0.95, got {self.drop:g}")

    def stamps(self, rate: float, seconds: float, rng: np.random.Generator) -> Array:
        """Times at which a sensor is sampled in [0, seconds], strictly increasing, shape (m,) [s]."""
        nominal = np.arange(int(np.ceil(seconds * rate - 1e-9))) / rate
        shift = np.clip(self.jitter * rng.standard_normal(len(nominal)), -0.45 / rate, 0.45 / rate)
        return np.clip(nominal + shift, 0.0, seconds)

    def kept(self, count: int, rng: np.random.Generator) -> NDArray[np.bool_]:
        """Which samples are not lost, shape (count,)."""
        return rng.random(count) >= self.drop

    def received(self, stamps: Array, rng: np.random.Generator) -> Array:
        """Times of arrival, shape (m,) [s]: half the delay is fixed, half is random."""
        return stamps + self.transport_delay * (0.5 + rng.exponential(0.5, len(stamps)))


@dataclass(frozen=True)
class MountedGyro:
    """A gyro as it really is.

    Attributes:
        sensor: as in the robot file.
        bias: true bias, shape (3,) [rad/s].
        R_imu_body: true mounting, shape (3, 3).
    """

    sensor: Gyro
    bias: Array
    R_imu_body: Array

    @classmethod
    def draw(cls, sensor: Gyro, bias_rng: np.random.Generator, mounting_rng: np.random.Generator) -> MountedGyro:
        """A bias and a mounting error about those of the robot file."""
        bias = sensor.bias + BIAS_SIGMA * bias_rng.standard_normal(3)
        error = Rotation.from_rotvec(MOUNTING_SIGMA * mounting_rng.standard_normal(3)).as_matrix()
        return cls(sensor, bias, sensor.R_imu_body @ error)


@dataclass(frozen=True)
class MountedAccelerometer:
    """An accelerometer as it really is, in the housing of its gyro.

    Attributes:
        sensor: as in the robot file.
        bias: true bias, shape (3,) [m/s^2].
        R_imu_body: true mounting of the IMU, shape (3, 3).
        gravity: that it feels, in the base frame, shape (3,) [m/s^2].
    """

    sensor: Accelerometer
    bias: Array
    R_imu_body: Array
    gravity: Array

    @classmethod
    def draw(cls, sensor: Accelerometer, rng: np.random.Generator, R: Array, gravity: Array) -> MountedAccelerometer:
        """A bias about that of the robot file; R is the rotation of its gyro."""
        bias = sensor.bias + ACCELERATION_BIAS_SIGMA * rng.standard_normal(3)
        return cls(sensor, bias, R, gravity)


def read_encoder(encoder: MotorEncoder | LinkEncoder, q_motor: Array, noise: Array, quantized: bool) -> Array:
    """What encoders read.

    Args:
        encoder: the sensor.
        q_motor: angles of the motors, or of the links, that they are at, shape (m, n_joints) [rad].
        noise: standard normal numbers of the same shape.
        quantized: steps and a little noise, or noise only.

    Returns:
        Readings, shape (m, n_joints) [rad].
    """
    if not quantized:
        return q_motor + encoder.zero + encoder.sigmas * noise
    step = np.sqrt(12.0 * (1.0 - ANALOG_SHARE**2)) * encoder.sigmas
    return step * np.rint((q_motor + encoder.zero + ANALOG_SHARE * encoder.sigmas * noise) / step)
