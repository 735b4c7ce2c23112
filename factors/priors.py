# SPDX-License-Identifier: BSD-3-Clause
"""Priors on the shared values, as the robot file states them.

Variables: dynamics, rotation or bias. Positive parameters carry their prior on the logarithm, with the relative
sigma; a rotation carries it on Log(R_prior^T R).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointscope.factors.calibration import DYNAMICS, Calibration, bias_block, rotation_block
from jointscope.factors.factor import Factor, Linearization, Samples
from jointscope.robots.bodies.body_rates import skew
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import AXES, Accelerometer, Gyro

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Prior:
    """One sample, no states."""

    states = 0

    def __len__(self) -> int:
        return 1

    def select(self, samples: Samples) -> Self:
        """There is one sample only."""
        return self


@dataclass(frozen=True)
class DynamicsPrior(_Prior):
    """Prior on the free dynamic parameters.

    Attributes:
        names: parameters, shape (p,).
        mean: prior mean as a coordinate, shape (p,).
        sigma: standard deviation of the coordinate, shape (p,).
    """

    names: tuple[str, ...]
    mean: Array
    sigma: Array

    name = "dynamics_prior"
    blocks = (DYNAMICS,)

    @staticmethod
    def of(robot: Robot) -> DynamicsPrior:
        """The prior of a robot's free parameters."""
        free = [p for p in robot.parameters.values() if not p.fixed]
        mean = [np.log(p.prior) if p.positive else p.prior for p in free]
        sigma = [p.coordinate_sigma for p in free]
        return DynamicsPrior(tuple(p.name for p in free), np.array(mean), np.array(sigma))

    @property
    def rows(self) -> tuple[str, ...]:
        """One row per parameter."""
        return tuple(f"{name}.prior" for name in self.names)

    @property
    def sigmas(self) -> Array:
        """Standard deviations, shape (p,)."""
        return self.sigma

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Coordinate - mean, shape (1, p)."""
        return (calibration.dynamics - self.mean)[None]

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and its constant derivative."""
        return Linearization(self.residual(x, calibration), (), {DYNAMICS: np.eye(len(self.mean))[None]})


@dataclass(frozen=True)
class BiasPrior(_Prior):
    """Prior on the bias of a gyro or accelerometer.

    Attributes:
        sensor: the sensor with the prior's mean and sigma.
    """

    sensor: Gyro | Accelerometer

    @property
    def name(self) -> str:
        """Name in reports."""
        return f"{self.sensor.name}.bias_prior"

    @property
    def rows(self) -> tuple[str, ...]:
        """One row per axis."""
        return tuple(f"{self.sensor.name}.bias_prior_{axis}" for axis in AXES)

    @property
    def blocks(self) -> tuple[str, ...]:
        """The bias."""
        return (bias_block(self.sensor.name),)

    @property
    def sigmas(self) -> Array:
        """Standard deviations, shape (3,) [rad/s]."""
        return np.full(3, self.sensor.bias_prior_sigma)

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Bias - mean, shape (1, 3) [rad/s]."""
        return (calibration[bias_block(self.sensor.name)] - self.sensor.bias)[None]

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and its constant derivative."""
        return Linearization(self.residual(x, calibration), (), {self.blocks[0]: np.eye(3)[None]})


@dataclass(frozen=True)
class RotationPrior(_Prior):
    """Prior on a gyro's mounting: Log(R_prior^T R).

    Attributes:
        sensor: the gyro with the prior's mean and sigma.
    """

    sensor: Gyro

    @property
    def name(self) -> str:
        """Name in reports."""
        return f"{self.sensor.name}.rotation_prior"

    @property
    def rows(self) -> tuple[str, ...]:
        """One row per axis of the body."""
        return tuple(f"{self.sensor.name}.rotation_prior_{axis}" for axis in AXES)

    @property
    def blocks(self) -> tuple[str, ...]:
        """The rotation."""
        return (rotation_block(self.sensor.name),)

    @property
    def sigmas(self) -> Array:
        """Standard deviations, shape (3,) [rad]."""
        return np.full(3, self.sensor.R_prior_sigma)

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Rotation vector from the prior's mean, shape (1, 3) [rad]."""
        R = calibration[rotation_block(self.sensor.name)]
        return Rotation.from_matrix(self.sensor.R_prior.T @ R).as_rotvec()[None]

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and the inverse right Jacobian of SO(3)."""
        residual = self.residual(x, calibration)
        return Linearization(residual, (), {self.blocks[0]: inverse_right_jacobian(residual[0])[None]})


def inverse_right_jacobian(w: Array) -> Array:
    """D Log(Exp(w) Exp(delta)) / d delta at delta = 0, shape (3, 3); w: rotation vector, shape (3,) [rad].

    Reference: Sola, Deray, Atchuthan (2018), "A micro Lie theory", eq. (144).
    """
    angle = float(np.linalg.norm(w))
    W = skew(w[None])[0]
    if angle < 1e-4:
        return np.eye(3) + 0.5 * W + W @ W / 12.0
    factor = 1.0 / angle**2 - (1.0 + np.cos(angle)) / (2.0 * angle * np.sin(angle))
    return np.eye(3) + 0.5 * W + factor * W @ W


def shared_priors(robot: Robot) -> list[Factor]:
    """The priors that all recordings of a robot share: dynamics and rotations."""
    return [DynamicsPrior.of(robot), *(RotationPrior(gyro) for gyro in robot.gyros)]
